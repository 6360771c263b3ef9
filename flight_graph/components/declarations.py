"""What a component's class declares, checked when the class is made: ports, records, parts, rates, faults."""

import difflib
import inspect
import pkgutil
import sys
from string import Formatter

import numpy as np

import msg_schemas
from flight_graph.components.findings import nearest
from flight_graph.components.placement import pose_signal
from flight_graph.components.places import refuse
from flight_graph.components.records import Parameters, State
from msg_schemas.signal import Signal

PARTS = ("start", "kernel", "output", "update", "place")
UNTIMED = ("start", "place")  # not fired by a schedule: they take no time, and no ports
METHODS = ("resolve", "fitted", "tables", "check", "warnings", "scene", "motion")
_TAKEN = ("t_ns", "p", "x", "inputs", "outputs")


def check(cls: type) -> None:
    """Raise FlightError with the first declaration that is wrong, its file and its line."""
    _check_names(cls)
    for declaration in ("inputs", "outputs"):
        _check_ports(cls, declaration)
    both = sorted(set(cls.inputs) & set(cls.outputs))
    if both:
        refuse(cls, "outputs", f"{', '.join(both)}: inputs and outputs at once; each port has a name of its own")
    _check_record(cls, "parameters", Parameters)
    _check_record(cls, "state", State)
    _check_parts(cls)
    _check_lists(cls)
    _check_faults(cls)


def _check_names(cls):
    """Names that no component declares, where they look like one that this class leaves out and hold what that would."""
    for name, value in vars(cls).items():
        meant = [word for word in _held_by(value) if word not in vars(cls)]
        hint = nearest(name, meant, "")
        if not hasattr(cls.__mro__[-2], name) and hint.startswith("did you mean"):
            refuse(cls, name, f"no component declares this; {hint}")
    for name in METHODS:
        if inspect.isfunction(vars(cls).get(name)):
            refuse(cls, name, "write @classmethod above it; a component's class is never instantiated")


def _held_by(value) -> tuple:
    """The declarations that hold things like this."""
    if isinstance(value, type):
        return ("parameters",) if issubclass(value, Parameters) else ("state",) if issubclass(value, State) else ()
    if isinstance(value, dict) and value:
        if all(isinstance(signal, Signal) for signal in value.values()):
            return "inputs", "outputs"
        return ("faults",) if all(isinstance(code, int) for code in value) else ("output_rate_hz",)
    if hasattr(value, "py_func"):
        return PARTS
    return ("rate_hz",) if isinstance(value, (int, float)) else ("optional_inputs",) if isinstance(value, tuple) else ()


def _check_ports(cls, declaration):
    ports = getattr(cls, declaration)
    if not isinstance(ports, dict):
        refuse(cls, declaration, f"a {type(ports).__name__} is not allowed; allowed: {{'port': SIGNAL, ...}}")
    for port, signal in ports.items():
        if not isinstance(port, str) or not port.isidentifier():
            refuse(cls, declaration, f"{port!r} is no name of a port; allowed: letters, digits and underscores")
        if port in _TAKEN:
            refuse(cls, declaration, f"'{port}' is no name for a port: a kernel's own arguments are "
                                      f"{', '.join(_TAKEN)}")
        if not isinstance(signal, Signal):
            refuse(cls, declaration, f"'{port}' is {_not_a_signal(signal)}")


def _not_a_signal(value):
    known = _signals()
    example = "a port takes a Signal, such as msg_schemas.cubli.ATTITUDE"
    if not isinstance(value, str):
        return f"{value!r}; {example}"
    topic = value.lstrip("/")
    if topic in known:
        return f"the text {value!r}; a port takes a Signal: {known[topic]}"
    near = difflib.get_close_matches(topic, known, 1)
    return f"the text {value!r}; " + (f"a port takes a Signal: {known[near[0]]} carries '{near[0]}'" if near else example)


def _signals():
    """topic -> where its Signal stands, of all signals in msg_schemas."""
    found = {}
    for module in pkgutil.iter_modules(msg_schemas.__path__, "msg_schemas."):
        for name, value in vars(sys.modules.get(module.name, msg_schemas)).items():
            if isinstance(value, Signal):
                found.setdefault(value.topic, f"{module.name}.{name}")
    return found


def _check_record(cls, declaration, base):
    value = getattr(cls, declaration)
    if isinstance(value, type) and issubclass(value, base):
        return
    other = {Parameters: State, State: Parameters}[base]
    if isinstance(value, type) and issubclass(value, other):
        refuse(cls, declaration, f"{value.__name__} is a class of {other.__name__}; "
                                 f"{declaration} takes one of {base.__name__}")
    what = value.__name__ if isinstance(value, type) else repr(value)
    refuse(cls, declaration, f"{what} is not allowed; allowed is a class of {base.__name__} (from "
                             "flight_graph.components.records)")


def parts(component) -> list[str]:
    """The parts that a component has, in the order of `PARTS`."""
    return [part for part in PARTS if getattr(component, part) is not None]


def _check_parts(cls):
    for part in PARTS:
        function = getattr(cls, part)
        if function is not None and not callable(function):
            meant = f"; did you mean '{part}s'?" if part == "output" else ""
            refuse(cls, part, f"a {type(function).__name__} is no function{meant or '; it takes a function under @kernel'}")
    if cls.place is not None and pose_signal(cls) is None:
        refuse(cls, "place", "only what moves can be put elsewhere: a component with an update, and with a true pose "
                             "(an output of geometry_msgs/PoseStamped or nav_msgs/Odometry of the role TRUTH)")
    if cls.kernel is not None and (cls.output is not None or cls.update is not None):
        refuse(cls, "kernel", "a component has either a kernel, or an output and an update (a plant); this one has both")
    if cls.kernel is None and cls.output is None and cls.update is None and not cls.is_foreign:
        refuse(cls, "", "it has no kernel; write 'kernel = ...', or 'output = ...' and 'update = ...' (a plant)")


def _check_lists(cls):
    for declaration, ports, kind in (("output_rate_hz", cls.outputs, "output"), ("optional_inputs", cls.inputs, "input")):
        given = getattr(cls, declaration)
        if isinstance(given, str):
            refuse(cls, declaration, f"{given!r} is a text; write a tuple: ({given!r},)")
        for port in given:
            if port not in ports:
                refuse(cls, declaration, f"there is no {kind} '{port}'; {nearest(str(port), ports)}")
    for made in cls.formatted:
        if made.port not in cls.outputs:
            refuse(cls, "formatted", f"there is no output '{made.port}'; {nearest(str(made.port), cls.outputs)}")
    rates = {"rate_hz": cls.rate_hz, **{f"output_rate_hz[{port!r}]": rate for port, rate in cls.output_rate_hz.items()}}
    for name, rate in rates.items():
        if isinstance(rate, bool) or not isinstance(rate, (int, float)) or not 0 < rate < float("inf"):
            refuse(cls, name.partition("[")[0], f"{rate!r} is not allowed; allowed: a number > 0 [Hz]")


def _check_faults(cls):
    if not isinstance(cls.faults, dict):
        refuse(cls, "faults", f"{cls.faults!r} is not allowed; allowed: {{1: 'sentence', ...}}")
    known = [*cls.parameters.dtype.names, *cls.state.dtype.names,
             *(name for signal in cls.outputs.values() for name in signal.dtype.names)]
    for code, sentence in cls.faults.items():
        if not isinstance(code, int) or code == 0 or not isinstance(sentence, str):
            refuse(cls, "faults", f"{code!r}: {sentence!r} is not allowed; allowed: a whole number that is not 0, "
                                  "and a sentence")
        try:
            names = [name for _, name, _, _ in Formatter().parse(sentence) if name is not None]
        except ValueError as error:
            refuse(cls, "faults", f"the sentence of {code}: {error}")
        for name in names:
            root = name.partition("[")[0].partition(".")[0]
            if root not in known:
                refuse(cls, "faults", f"the sentence of {code} names '{root}', which is no parameter, nor in the "
                                      f"state or an output; {nearest(root, known, 'known are')}")
        try:
            sentence.format(**_empty(cls))
        except (ValueError, TypeError, LookupError, AttributeError) as error:
            refuse(cls, "faults", f"the sentence of {code} cannot be filled in: {error}; a name stands for a number or a "
                                  "list of numbers: {name}, {name[0]}, {name:.3f}")


def _empty(cls) -> dict:
    """name -> value of what a sentence of a fault may name, all zero, as `flight_graph.engines.stops` fills them in."""
    values = {}
    for dtype in [*(signal.dtype for signal in cls.outputs.values()), cls.state.dtype, cls.parameters.dtype]:
        record = np.zeros(1, dtype)[0]
        for name in dtype.names:
            values[name] = record[name].tolist() if np.ndim(record[name]) else record[name]
    return values
