"""The pictures of docs/seeing.md: each vehicle in the real viewers, in a browser without a screen.

    python benchmarks/viewer_pictures.py [--only rerun|lichtblick] [--lichtblick FOLDER] [--out docs/images]

Needs Chromium, the extras [view] and [foxglove], and the package websockets; for Lichtblick also a web build of it (FOLDER
with its index.html; its own README says how it is made).
"""

import argparse
import base64
import contextlib
import functools
import http.server
import json
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from pathlib import Path
from urllib.parse import quote

from websockets.sync.client import connect

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from flight_graph.viewers.rerun_page import RerunPage

ROOT = Path(__file__).resolve().parents[1]
FLIGHT = Path(sys.executable).with_name("flight")
SCENARIOS = {"cubli_asteroid": 20.0, "spacerobot_harmonic": 10.0, "lander_nominal": 300.0}  # and the seconds that are flown
SIZE = (1400, 880)  # [px]
PATIENCE_S = 120.0
WAIT_S = 150.0  # [s] a viewer without a graphics processor takes to draw
PLACEHOLDER = "/*LICHTBLICK_SUITE_DEFAULT_LAYOUT_PLACEHOLDER*/"


class Browser:
    """A Chromium that is steered through its debugging port."""

    def __init__(self, folder: Path):
        found = shutil.which("chromium") or shutil.which("google-chrome")
        if found is None:
            raise SystemExit("the pictures need a browser: apt-get install chromium brings one")
        self._process = subprocess.Popen(
            [found, "--headless=new", "--no-sandbox", "--no-first-run", "--remote-debugging-port=0",
             "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--remote-allow-origins=*",
             f"--user-data-dir={folder}", f"--window-size={SIZE[0]},{SIZE[1]}", "about:blank"],
            stderr=subprocess.PIPE, text=True)
        line = next(line for line in self._process.stderr if "DevTools listening on" in line)
        threading.Thread(target=lambda: [None for _ in self._process.stderr], daemon=True).start()
        port = line.split("127.0.0.1:")[1].split("/")[0]
        pages = []
        while not pages:
            known = json.load(urllib.request.urlopen(f"http://127.0.0.1:{port}/json"))
            pages = [one for one in known if one["type"] == "page"]
        self._socket = connect(pages[0]["webSocketDebuggerUrl"], max_size=None).__enter__()
        self._number = 0
        self.ask("Emulation.setDeviceMetricsOverride", width=SIZE[0], height=SIZE[1], deviceScaleFactor=1, mobile=False)

    def ask(self, method: str, **parameters) -> dict:
        """Call a method of the browser's protocol."""
        self._number += 1
        self._socket.send(json.dumps({"id": self._number, "method": method, "params": parameters}))
        while (said := json.loads(self._socket.recv(timeout=PATIENCE_S))).get("id") != self._number:
            pass
        if "error" in said:
            raise SystemExit(f"the browser does not {method}: {said['error']}")
        return said["result"]

    def photograph(self, address: str, path: Path, seconds: float) -> None:
        """Open an address, let it draw for some seconds, and write what it shows."""
        self.ask("Page.navigate", url=address)
        time.sleep(seconds)
        path.write_bytes(base64.b64decode(self.ask("Page.captureScreenshot", format="png")["data"]))
        print(path)

    def close(self) -> None:
        self._socket.close()
        self._process.terminate()
        self._process.wait()


@contextlib.contextmanager
def started(*arguments: str):
    """A `flight` that serves; its address."""
    process = subprocess.Popen([FLIGHT, *arguments], stdout=subprocess.PIPE, text=True)
    try:
        address = process.stdout.readline().strip()
        if not address:
            raise SystemExit(f"flight {' '.join(arguments)} does not serve")
        yield address
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(20.0)


@contextlib.contextmanager
def site(folder: Path):
    """A folder served as a page of this machine; its address."""
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(_Quiet, directory=str(folder))) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


def rerun(browser: Browser, bags: dict[str, Path], out: Path, work: Path) -> None:
    """Each vehicle in Rerun's web viewer, from the recording that `flight view --save` writes."""
    page = RerunPage("127.0.0.1", 9190, "this script")
    viewer = page.address.partition("?")[0]
    try:
        with site(work) as files:
            for name, bag in bags.items():
                subprocess.run([FLIGHT, "view", bag, "--save", work / f"{name}.rrd", "--points", "300"], check=True,
                               stdout=subprocess.DEVNULL)
                recording = quote(f"{files}/{name}.rrd", safe="")
                browser.photograph(f"{viewer}?url={recording}", out / f"rerun_{name}.png", WAIT_S)
                browser.ask("Page.navigate", url="about:blank")
    finally:
        page.close()


def lichtblick(browser: Browser, bags: dict[str, Path], build: Path, out: Path, work: Path) -> None:
    """Each vehicle in Lichtblick, live from `flight serve`, in the layout that ships."""
    for number, (name, bag) in enumerate(bags.items()):
        layout = subprocess.run([FLIGHT, "layout", name, "--for", "lichtblick"], check=True, capture_output=True, text=True)
        folder = work / f"lichtblick_{name}"
        shutil.copytree(build, folder)
        page = folder / "index.html"
        page.write_text(page.read_text(encoding="utf-8").replace(PLACEHOLDER, layout.stdout), encoding="utf-8")
        with site(folder) as pages, started("serve", str(bag), "--port", str(9290 + number), "--speed", "0.2") as address:
            browser.photograph(f"{pages}/?ds=foxglove-websocket&ds.url={quote(address)}", out / f"lichtblick_{name}.png",
                               WAIT_S)
            browser.ask("Page.navigate", url="about:blank")


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def end_headers(self):
        self.send_header("Access-Control-Allow-Origin", "*")  # the viewer is a page of another port
        super().end_headers()

    def log_message(self, *_):
        pass


def main() -> None:
    """Fly the vehicles, open each of them in each viewer, write the pictures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", choices=("rerun", "lichtblick"))
    parser.add_argument("--lichtblick", type=Path, help="a web build of Lichtblick")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "images")
    parser.add_argument("scenarios", nargs="*", default=list(SCENARIOS))
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        work, bags = Path(folder), {}
        for name in options.scenarios:
            bags[name] = work / name
            subprocess.run([FLIGHT, "run", name, "--duration", str(SCENARIOS[name]), "--out", bags[name], "--json"],
                           check=True, stdout=subprocess.DEVNULL)
        browser = Browser(work / "profile")
        try:
            if options.only != "lichtblick":
                rerun(browser, bags, options.out, work)
            if options.lichtblick and options.only != "rerun":
                lichtblick(browser, bags, options.lichtblick, options.out, work)
        finally:
            browser.close()


if __name__ == "__main__":
    main()
