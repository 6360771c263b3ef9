"""Rerun's viewer as a page: its own server in a process beside this one, on this machine alone unless asked otherwise."""

import os
import socket
import subprocess
import time
from pathlib import Path
from urllib.parse import quote

from flight_graph.errors import FlightError
from flight_graph.extras import required

_APART = {"process_group": 0} if os.name == "posix" else {}  # Ctrl-C is for us: the server ends after its data
READY_S = 30.0  # [s] in which the server answers


class RerunPage:
    """Serves the viewer and its data until it is closed. Raises FlightError where the port cannot be had."""

    def __init__(self, host: str, port: int, command: str):
        package = Path(required("rerun_cli", "view", command).__file__).parent
        programs = [path for name in ("rerun", "rerun.exe", "Rerun.app/Contents/MacOS/Rerun")
                    if (path := package / name).is_file()]
        if not programs:
            raise FlightError(f"{command}: the installed rerun-sdk carries no viewer; install its wheel from the package "
                              "index anew")
        _refuse_taken(host, port)
        self._host, self._port, self._data_port = host, port, _free_port(host)
        self._process = subprocess.Popen(
            [str(programs[0]), "--serve-web", "--bind", host, "--port", str(self._data_port),
             "--web-viewer-port", str(port)],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, **_APART)
        self._wait()

    @property
    def source(self) -> str:
        """Where recordings are sent."""
        return f"rerun+http://{_reached(self._host)}:{self._data_port}/proxy"

    @property
    def address(self) -> str:
        """What to open in a browser."""
        return f"http://{_reached(self._host)}:{self._port}/?url={quote(self.source, safe='')}"

    @property
    def has_ended(self) -> bool:
        """Whether the server is gone."""
        return self._process.poll() is not None

    def _wait(self):
        deadline = time.monotonic() + READY_S
        for port in (self._data_port, self._port):
            while not _answers(self._host, port):
                if self.has_ended:
                    words = self._process.stderr.read().decode(errors="replace").strip().splitlines()
                    said = (words or ["without a word"])[-1]
                    raise FlightError(f"Rerun's server has ended ({said})")
                if time.monotonic() > deadline:
                    self.close()
                    raise FlightError(f"Rerun's server does not answer on port {port} within {READY_S:g} s")
                time.sleep(0.05)

    def close(self) -> None:
        """End the server."""
        self._process.terminate()
        try:
            self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def _reached(host: str) -> str:
    return "127.0.0.1" if host in ("0.0.0.0", "::") else host  # noqa: S104 (every address: this one too)


def _answers(host, port) -> bool:
    try:
        with socket.create_connection((_reached(host), port), 0.5):
            return True
    except OSError:
        return False


def _refuse_taken(host, port):
    try:
        with socket.create_server((host, port)):
            pass
    except (OSError, OverflowError) as error:
        raise FlightError(f"--host {host} --port {port}: nothing can be served there "
                          f"({(getattr(error, 'strerror', None) or str(error)).lower()}); another port may be free, as "
                          f"--port {port + 1}") from None


def _free_port(host) -> int:
    with socket.create_server((host, 0)) as found:
        return found.getsockname()[1]
