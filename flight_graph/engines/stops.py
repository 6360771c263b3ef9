"""Why a run ends before its time: codes of the driver, and the sentences a person reads."""

from dataclasses import dataclass

import numpy as np

NONFINITE = 1  # an output is not finite
FAULT = 2  # state.fault is set
RAISED = -(1 << 62)  # [code in state.fault] plus the number of an error that a kernel raised
_NUMBERS = 1 << 33  # more than there are numbers of errors
REASONS = {NONFINITE: "nonfinite", FAULT: "fault"}


@dataclass(frozen=True)
class Records:
    """The (1,) records of a component that a sentence reads. outputs: by port."""

    parameters: np.ndarray
    state: np.ndarray
    outputs: dict[str, np.ndarray]


def fault_sentence(name: str, part: str, component, records: Records, seconds: float,
                   errors: dict[int, str] | None = None) -> str:
    """The sentence of a fault code, with the values it names filled in; or of an error that was raised.

    A name is looked for in parameters, state, then outputs. errors: of the part that ran, see
    `flight_graph.engines.parts.Code`.
    """
    code = int(records.state["fault"][0])
    if is_raised(code):
        return raised_sentence(name, part, (errors or {}).get(code - RAISED, "an error"), seconds)
    text = component.faults.get(code, f"fault {code}")
    read = [*reversed(records.outputs.values()), records.state, records.parameters]
    values = {key: _readable(array[0][key]) for array in read for key in array.dtype.names}
    return f"{name} stopped at t = {seconds:g} s: {text.format(**values)}"


def is_raised(code: int) -> bool:
    """Whether a fault code stands for an error that a kernel raised."""
    return RAISED <= code < RAISED + _NUMBERS


def raised_sentence(name: str, part: str, error: str, seconds: float) -> str:
    """The sentence of an error that a kernel raised."""
    return f"{name} stopped at t = {seconds:g} s: its {part} raised {error}"


def nonfinite_sentence(name, port, signal, record, seconds) -> str | None:
    """Which field of an output is not finite, in words; None when all are."""
    body = np.ascontiguousarray(record).view("u1").reshape(-1)
    for path, dtype, offset, length in signal.leaves():
        if dtype.base.kind == "f" and path not in signal.may_be_nonfinite:
            values = body[offset:offset + length].view(dtype.base)
            if not np.isfinite(values).all():
                index = int(np.argmin(np.isfinite(values)))
                return (f"{name} stopped at t = {seconds:g} s: its output {port}.{path}"
                        f"{f'[{index}]' if dtype.shape else ''} is {values[index]}; only finite numbers are published")
    return None


def stop_sentence(name: str, part: str, component, code: int, records: Records, seconds: float,
                  errors: dict[int, str] | None = None) -> str:
    """Why a firing stopped a run."""
    if code == FAULT:
        return fault_sentence(name, part, component, records, seconds, errors)
    sentences = (nonfinite_sentence(name, port, signal, records.outputs[port], seconds)
                 for port, signal in component.outputs.items())
    return next(filter(None, sentences), f"{name} stopped at t = {seconds:g} s")


def _readable(value):
    return np.asarray(value).tolist() if np.ndim(value) else value
