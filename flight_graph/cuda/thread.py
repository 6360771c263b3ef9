"""What one thread of a device does: the driver's loop for the run of its number."""

from numba import types

from flight_graph.engines.addresses import compiled, row
from flight_graph.engines.driver import CONTROL, run

SIGNATURE = types.int64(*[types.int64] * 5)


@compiled
def fly(number, controls, stride, count, end):
    """Bring a run until before the tick ``end``, unless it has stopped. controls, stride: where its control record lies, of
    ``count`` runs.
    """
    if number < count:
        control_at = controls + number * stride
        control = row(control_at, CONTROL)
        if control.stop == 0:
            control.end = end
            run(control_at)
    return 0
