"""How long it takes from the end of `make demo` until the rover moves in 3-D, by what the demo says comes next.

    python benchmarks/first_look.py

Runs `flight demo` as make does, takes the command from its last line, lets it open a browser without a screen in place of a
person's, presses Play there, and waits until the rover is where it is a second later. Needs a browser (chromium).
"""

import os
import shlex
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from urllib.parse import unquote, urlparse

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from tests.reports.browser import Browser

MOVED = "Number(document.querySelector('.space').dataset.time || 0) > 1.0"


def main() -> None:
    """Run the demo and the command that it names, and print what each step took."""
    with tempfile.TemporaryDirectory() as folder:
        opener, said = Path(folder) / "opener", Path(folder) / "address"
        opener.write_text(f'#!/bin/sh\nprintf "%s" "$1" > {shlex.quote(str(said))}\n')
        opener.chmod(0o755)
        environment = {**os.environ, "BROWSER": f"{opener} %s", "DISPLAY": os.environ.get("DISPLAY", ":0")}
        flight, began = Path(sys.executable).with_name("flight"), time.monotonic()
        demo = subprocess.run([flight, "demo"], cwd=folder, env=environment, capture_output=True, text=True)
        last = demo.stderr.strip().splitlines()[-1]
        if demo.returncode or not last.startswith("next: "):
            raise SystemExit(f"flight demo: {last}")
        print(f"flight demo took {time.monotonic() - began:.1f} s; {last}")
        began, words = time.monotonic(), shlex.split(last.removeprefix("next: "))
        subprocess.run([flight, *words[1:]], cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL)
        written = time.monotonic() - began
        with Browser(Path(unquote(urlparse(said.read_text()).path)), (1280, 800)) as browser:
            browser.wait("document.querySelector('.space').dataset.drawn === 'yes'")
            drawn = time.monotonic() - began
            browser.click(".play")
            browser.wait(MOVED)
        print(f"page written and opened after {written:.1f} s, rover drawn after {drawn:.1f} s, moved a second of its time "
              f"after {time.monotonic() - began:.1f} s; load of the machine {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
