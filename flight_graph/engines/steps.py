"""The compiled parts of one component, one call a firing: what nodes and replays run."""

from numba import config

from flight_graph.components.component import Component
from flight_graph.engines import source

PARTS = ("start", "kernel", "output", "update")


def ports(component: type[Component], part: str) -> tuple[list[str], list[str]]:
    """The inputs and the outputs that a part takes, in the order of its arguments."""
    inputs = [] if part in ("start", "output") else list(component.inputs)
    outputs = [] if part in ("start", "update") else list(component.outputs)
    return inputs, outputs


def load(use: str, component: type[Component]) -> dict:
    """part -> step(t_ns, parameters, state, *inputs, *outputs), loaded or compiled, each run once on scratch records.

    A step returns 0, or a stop code of `flight_graph.engines.source.step_source`.
    """
    steps = {}
    for part in PARTS:
        function = getattr(component, part)
        if function is None:
            continue
        steps[part] = source.load(source.step_source(use, component, part), [function], f"step_{part}").step
        inputs, outputs = ports(component, part)
        records = [component.inputs[port].new()[1] for port in inputs]
        records += [component.outputs[port].new()[1] for port in outputs]
        if not config.DISABLE_JIT:
            steps[part](0, component.parameters.record(), component.state.record(), *records)
    return steps
