"""Where a run is shown: Rerun's window, its page in a browser, or a file."""

import signal
import time
import webbrowser
from contextlib import contextmanager
from pathlib import Path

from flight_graph.cli.show import status
from flight_graph.errors import FlightError
from flight_graph.viewers.display import has_display

PORT = 9090  # of the page


@contextmanager
def shown(stream, command: str, host: str, port: int | None, save: Path | None = None):
    """Send a stream to a page (where a port is given), a file, or a window. A page stays until Ctrl-C."""
    if save is not None:
        stream.save(save)
        yield
        stream.close()
        print(save)
        return
    if port is None:
        stream.open_window()
        yield
        stream.close()
        return
    from flight_graph.viewers.rerun_page import RerunPage
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    page = RerunPage(host, port, command)
    try:
        stream.connect(page.source)
        print(page.address, flush=True)
        status("Ctrl-C ends it" if _opened(page.address) else
               "no browser could be started: open the address in one; Ctrl-C ends it")
        yield
        while not page.has_ended:
            time.sleep(0.2)
        raise FlightError("Rerun's server has ended")
    except KeyboardInterrupt:
        status("ended")
    finally:
        if not page.has_ended:
            stream.close(1.0)
        page.close()
        signal.signal(signal.SIGTERM, before)


@contextmanager
def watched(scenario, live: bool):
    """A stream that shows a run while it runs, or None."""
    if not live:
        yield None
        return
    from flight_graph.viewers import opening
    from flight_graph.viewers.rerun_stream import RerunStream
    scene, notes = opening.picture_of(scenario)
    stream = RerunStream(scenario.name, scene, scenario.epoch_ns, command="flight run --live")
    for note in notes:
        status(note)
    if not has_display():
        status("there is no display here: it is shown as a page")
    with shown(stream, "flight run --live", "127.0.0.1", None if has_display() else PORT):
        yield stream
        for note in stream.notes:
            status(note)


def _opened(address: str) -> bool:
    """Whether a browser of this machine has been asked to show an address."""
    try:
        return has_display() and webbrowser.open(address)
    except webbrowser.Error:
        return False
