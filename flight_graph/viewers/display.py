"""Whether a window can be shown here."""

import os
import sys

from flight_graph.errors import FlightError


def has_display() -> bool:
    """Whether a window can be shown here."""
    return not sys.platform.startswith("linux") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def refuse_without_display(command: str) -> None:
    """Refuse a window where none can be shown. Raises FlightError."""
    if not has_display():
        raise FlightError(f"{command}: there is no display here (neither DISPLAY nor WAYLAND_DISPLAY is set); --web shows "
                          "it in a browser, also on another machine; --save FILE.rrd keeps it for later")
