"""A run that is watched while it runs: its messages go to a viewer as they come."""

import threading
import time

from flight_graph.timebase import SECOND
from flight_graph.viewers.messages import in_memory
from flight_graph.viewers.rerun_stream import RerunStream
from flight_graph.viewers.source import Source

PERIOD_S = 0.1  # [s] between two looks at the source


def show(source: Source, stream: RerunStream, factor: float, stop: threading.Event, progress=None) -> None:
    """Send a source to Rerun until it is over, at ``factor`` simulated seconds a second, or as it comes (ROS).

    progress(seconds simulated) is called now and then.
    """
    began, now_ns = time.monotonic(), source.begin_ns
    while True:
        is_last = stop.is_set()  # what came before is still shown
        if source.end_ns is not None:
            now_ns = min(source.end_ns, source.begin_ns + round((time.monotonic() - began) * factor * SECOND))
        messages = source.take(now_ns)
        if messages:
            stream.add(in_memory(source.streams, messages, source.units))
            now_ns = max(now_ns, messages[-1].stamp_ns)
        if progress:
            progress((now_ns - source.begin_ns) / SECOND)
        if source.is_over or is_last:
            return
        stop.wait(PERIOD_S)
