"""What a component is: a kernel over records, and the declarations a person and an engine need.

A component is a class that is never instantiated. One of two forms:

* ``kernel(t_ns, parameters, state, *inputs, *outputs)``: outputs at t depend on inputs at t (an estimator, a controller);
* ``output(t_ns, parameters, state, *outputs)`` and ``update(t_ns, parameters, state, *inputs)``: outputs at t depend on
  the state alone (a plant); ``update`` moves the state from t to t + period with the inputs of t held.

A part made with `flight_math.kernel` gets views of its records: fields read and assigned as values (docs/values.md). One
that would take more than seven arguments is written ``kernel(t_ns, p, x, inputs, outputs)``,
``output(t_ns, p, x, outputs)``, ``update(t_ns, p, x, inputs)``: named tuples of views, ``inputs.odometry``.

``start(parameters, state)`` prepares the state once. ``place(parameters, state, placement)`` of a component that moves puts
it elsewhere (`flight_graph.components.placement`), before its first firing at the time of an event or a service call.

``t_ns`` counts from the start of the run. The engine stamps every
output before the kernel runs, so ``same_stamp(input.header.stamp, output.header.stamp)`` tells whether an input is new.
An input that never arrived is zero, stamp included.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import ClassVar

import numpy as np

from flight_graph.components import declarations, declared
from flight_graph.components.findings import nearest
from flight_graph.components.placement import TrueMotion, motion_of_pose
from flight_graph.components.places import refuse
from flight_graph.components.records import Parameters, State
from flight_math.kernel import kernel as _kernel
from flight_math.values import Kinds, Quaternion, Vec, Vec3
from msg_schemas.qos import Role
from msg_schemas.signal import Signal


@_kernel
def same_stamp(a, b):
    """True when two stamps are equal."""
    return a.sec == b.sec and a.nanosec == b.nanosec


@cache
def kinds_of(signal: Signal) -> Kinds:
    """The fields of a signal that kernels see as values."""
    classes = {"Vec3": Vec3, "Quaternion": Quaternion}
    return Kinds.of((path, classes.get(kind) or Vec(kind)) for path, kind in signal.values)


@dataclass(frozen=True)
class Formatted:
    """A message without a fixed layout, made from an output's record by one function for every engine.

    function(record) takes the output's record (fields by attribute) and returns the message as an object of the type store
    (msg_schemas.definitions.TYPESTORE). once: it is said at the start of a run alone; its role is LATCHED then.
    of_scene: the function takes what the component's `scene` says of its parameters too: function(record, scene).
    """

    topic: str
    type_name: str
    port: str
    function: Callable
    role: Role = Role.DIAGNOSTICS
    once: bool = False
    of_scene: bool = False

    def bound(self, scene: Callable) -> "Formatted":
        """The message of a component whose ``scene()`` this is: its function takes the record alone."""
        return replace(self, function=lambda record: self.function(record, scene())) if self.of_scene else self


class Component:
    """Base of all components; see the module's text."""

    parameters: ClassVar[type[Parameters]] = Parameters
    state: ClassVar[type[State]] = State
    inputs: ClassVar[dict[str, Signal]] = {}
    outputs: ClassVar[dict[str, Signal]] = {}
    rate_hz: ClassVar[float] = 100.0
    output_rate_hz: ClassVar[dict[str, float]] = {}  # outputs slower than the component
    formatted: ClassVar[tuple[Formatted, ...]] = ()
    faults: ClassVar[dict[int, str]] = {}  # state.fault -> sentence; {name}: of parameters, state, outputs
    optional_inputs: ClassVar[tuple[str, ...]] = ()  # may stay unconnected (they read zero)
    namespace: ClassVar[str] = ""  # that it is in, see `flight_graph.components.namespaces`
    outside: ClassVar[type | None] = None  # the same component in no namespace
    is_foreign: ClassVar[bool] = False  # a node that is not ours: it has ports and no parts
    modes: ClassVar[tuple[str, ...]] = ()  # of a mode manager; it fires by the clock, whether or not its inputs have come
    start = None
    kernel = None
    output = None
    update = None
    place = None

    def __init_subclass__(cls):
        declarations.check(cls)

    @classmethod
    def said(cls, values: dict) -> list[Formatted]:
        """The formatted messages, bound to the scene of these resolved parameters; it is made when it is needed."""
        scene = cache(lambda: declared.call(cls, "scene", values))
        return [made.bound(scene) for made in cls.formatted]

    @classmethod
    def kernels(cls) -> list:
        """The compiled functions of this component."""
        return [getattr(cls, part) for part in declarations.parts(cls)]

    @classmethod
    def summary(cls) -> str:
        """First line of the docstring."""
        text = (cls.__doc__ or sys.modules[cls.__module__].__doc__ or "").strip()
        return text.splitlines()[0] if text else ""

    @classmethod
    def resolve(cls, values: dict, where: str, folder: Path | None = None) -> dict:
        """Parameters that follow from others: return the values to run with, by default as they are. Raises FlightError.

        Called once before a run, after each value was checked by itself and before `check`. What it computes (a site's
        gravity from its latitude) is written into the bag, so it must come out the same when done again on its result.
        folder: where a relative file name starts.
        """
        return values

    @classmethod
    def fitted(cls, values: dict) -> str | None:
        """The name (``module:attribute``) of the class to run with these resolved parameters; None: this one.

        Where tables need more room than this class has: the layout of a state is part of its class.
        """
        return None

    @classmethod
    def tables(cls, values: dict) -> dict[str, np.ndarray]:
        """State entries that are filled before `start` from the resolved parameters: name -> array of its shape.

        Plain Python, run by every engine: for what a parameter cannot hold, as the mesh of a body. An entry has a
        fixed capacity; how much of it is used is an entry of its own. A parameter set later does not change them.
        """
        return {}

    @classmethod
    def initial_state(cls, values: dict) -> np.ndarray:
        """A fresh state record (1,) with the tables of these parameters."""
        record = cls.state.record()
        for name, table in declared.call(cls, "tables", values).items():
            if name not in cls.state.entries:
                refuse(cls, "tables", f"there is no '{name}' in the state; {nearest(name, cls.state.entries)}")
            if np.shape(table) != record[name].shape[1:]:
                refuse(cls, "tables", f"{name} has the shape {np.shape(table)}, the state's entry {record[name].shape[1:]}")
            record[name][0] = table
        return record

    @classmethod
    def scene(cls, values: dict):
        """What is to be seen of these resolved parameters: a `flight_graph.scenes.scene.Scene`, or None.

        Declared by whatever knows where the vehicle is, a plant as a rule. Plain numbers that come out the same on every
        machine: its model and its fixed frames are recorded.
        """
        return None

    @classmethod
    def motion(cls, outputs: dict) -> TrueMotion:
        """Where a component that moves truly is, by its outputs: port -> record, fields by attribute.

        By default what its true pose says; override where other outputs say more: velocities, accelerations.
        """
        return motion_of_pose(cls, outputs)

    @classmethod
    def warnings(cls, values: dict, period_s: float) -> list[str]:
        """Sentences about parameters that are allowed, but with which trouble must be expected; with the numbers.

        period_s: the component's own period. `flight run` shows them, and the bag carries them.
        """
        return []

    @classmethod
    def check(cls, values: dict, where: str) -> None:
        """Check parameters against each other; raise FlightError. Override where ranges alone do not say it all."""
