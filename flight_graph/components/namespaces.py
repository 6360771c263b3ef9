"""A component inside a namespace: its topics and the frames of its messages begin with the namespace.

    namespaces.within(CubliPlant, "rover_a")      # publishes rover_a/cubli/truth, in the frame rover_a/cubli_base

In a scenario it is called ``USE@NAMESPACE``, as ``sim_nodes/cubli_plant@rover_a``. Topics that all nodes share by
convention (``/diagnostics``, ``/tf``, ``/tf_static``) stay what they are, and so does the frame ``map``; what travels
there names its sender and its frames in full. The kernels are the same ones; the layout of messages is not (a frame's
name is part of it): `flight_graph.engines.moved` lets one machine code serve all.
"""

from dataclasses import replace
from functools import cache

from flight_graph.components import names
from flight_graph.components.component import Component, Formatted
from msg_schemas.signal import Signal

SHARED = ("diagnostics", "tf", "tf_static")  # topics that many nodes publish by convention
MAP = "map"  # the frame that all vehicles share


def within(component: type[Component], namespace: str) -> type[Component]:
    """A component as it is inside a namespace (of one in a namespace already: the whole one)."""
    base = component.outside or component
    return _within(base, names.joined(namespace, component.namespace)) if namespace else component


def split(use: str) -> tuple[str, str]:
    """The name of a component without its namespace, and the namespace; empty where there is none."""
    plain, at, namespace = use.rpartition("@")
    if at and all(map(names.is_word, namespace.split("."))):
        return plain, namespace
    return use, ""


def use_within(use: str, namespace: str) -> str:
    """What a component of this ``use`` is called inside a namespace."""
    plain, inner = split(use)
    return f"{plain}@{names.joined(namespace, inner)}"


def topic_within(topic: str, namespace: str) -> str:
    """A topic as it is inside a namespace."""
    return f"{names.ros(namespace)}/{topic}" if namespace and topic not in SHARED else topic


@cache
def _within(component, namespace):
    ports = {kind: {port: signal_within(signal, namespace) for port, signal in getattr(component, kind).items()}
             for kind in ("inputs", "outputs")}
    made = tuple(_formatted(one, namespace) for one in component.formatted)
    return type(component.__name__, (component,), {
        **ports, "formatted": made, "namespace": namespace, "outside": component, "__doc__": component.__doc__,
        "__module__": component.__module__})


@cache
def signal_within(signal: Signal, namespace: str) -> Signal:
    """A signal as it is inside a namespace."""
    fixed = {path: frame_within(value, namespace) if path.endswith("frame_id") else value
             for path, value in signal.fixed.items()}
    return replace(signal, topic=topic_within(signal.topic, namespace), fixed=fixed)


def frame_within(name: str, namespace: str) -> str:
    """A frame as it is inside a namespace; `MAP` is one for all, and no frame is none."""
    return f"{names.ros(namespace)}/{name}" if namespace and name and name != MAP else name


def _formatted(made: Formatted, namespace: str) -> Formatted:
    function = made.function

    def formatted(record, *scene):
        message = function(record, *scene)
        _name_in_full(message, namespace)
        return message

    formatted.__doc__ = function.__doc__
    return replace(made, topic=topic_within(made.topic, namespace), function=formatted)


def _name_in_full(message, namespace):
    """Frames of a message and of all in it get the namespace, and so do the senders of diagnostics."""
    for name in getattr(message, "__dataclass_fields__", ()):
        value = getattr(message, name)
        if name.endswith("frame_id") and isinstance(value, str):
            setattr(message, name, frame_within(value, namespace))
        elif isinstance(value, list):
            for part in value:
                _name_in_full(part, namespace)
        elif type(message).__name__.endswith("DiagnosticStatus") and name == "name":
            setattr(message, name, f"{names.ros(namespace)}/{value}")
        else:
            _name_in_full(value, namespace)
