"""A page in a real browser without a screen and without a network, spoken to over its debugging pipe."""

import fcntl
import json
import os
import shutil
import subprocess
import tempfile
import time

import pytest

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
SWITCHES = ("--headless=new", "--no-sandbox", "--enable-unsafe-swiftshader", "--no-first-run", "--hide-scrollbars",
            "--disable-background-networking", "--host-resolver-rules=MAP * ~NOTFOUND",
            "--remote-debugging-pipe")
LISTENER = """
window.bad = [];
for (const kind of ['error', 'unhandledrejection', 'securitypolicyviolation'])
  window.addEventListener(kind, e => bad.push(kind + ' ' + (e.message || e.reason || e.blockedURI)));
window.drawnAt = null;
new MutationObserver(() => {
  if (drawnAt === null && document.querySelector('[data-drawn=yes]')) drawnAt = performance.now();
}).observe(document, {subtree: true, attributes: true, attributeFilter: ['data-drawn']});
"""
TIMEOUT_S = 240


class Browser:
    """An open page. A context; skips the test where there is no browser. bad: errors, and what the page's policy forbade."""

    def __init__(self, path, size=(900, 700)):
        """path: of the page's file; size: of the window [px]."""
        self._path, self._size, self._number = path, size, 0

    def __enter__(self):
        browser = next(filter(None, map(shutil.which, BROWSERS)), None)
        if browser is None:
            pytest.skip(f"no browser is installed here ({', '.join(BROWSERS)}): apt-get install chromium brings one")
        self._profile = tempfile.TemporaryDirectory(prefix="browser_", ignore_cleanup_errors=True)
        (theirs_in, mine_out), (mine_in, theirs_out) = os.pipe(), os.pipe()

        def hand_over():
            """The pipe of the protocol: 3 in, 4 out."""
            ends = [fcntl.fcntl(end, fcntl.F_DUPFD, 10) for end in (theirs_in, theirs_out)]
            for end, number in zip(ends, (3, 4)):
                os.dup2(end, number)

        self._process = subprocess.Popen(
            [browser, *SWITCHES, f"--window-size={self._size[0]},{self._size[1]}",
             f"--user-data-dir={self._profile.name}", "about:blank"], close_fds=False,
            preexec_fn=hand_over, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(theirs_in)
        os.close(theirs_out)
        self._out, self._in = os.fdopen(mine_out, "wb"), os.fdopen(mine_in, "rb")
        os.set_blocking(self._in.fileno(), False)
        self._rest, self._session = b"", None
        target = self.say("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.say("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        self.say("Performance.enable", timeDomain="threadTicks")
        self.say("Page.enable")
        self.say("Page.addScriptToEvaluateOnNewDocument", source=LISTENER)
        self.say("Page.navigate", url=f"file://{self._path.resolve()}")
        self.wait("location.protocol === 'file:' && document.readyState === 'complete'")
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.wait()
        self._out.close()
        self._in.close()
        self._profile.cleanup()

    def say(self, method: str, **parameters) -> dict:
        """A command of the protocol, and its answer."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters} | (
            {"sessionId": self._session} if self._session else {})
        self._out.write(json.dumps(message).encode() + b"\0")
        self._out.flush()
        while (answer := self._next()).get("id") != self._number:
            pass
        assert "error" not in answer, f"{method}: {answer}"
        return answer["result"]

    def _next(self) -> dict:
        deadline = time.monotonic() + TIMEOUT_S
        while b"\0" not in self._rest:
            assert self._process.poll() is None, f"the browser has ended with {self._process.returncode}"
            assert time.monotonic() < deadline, f"the browser has not answered for {TIMEOUT_S} s"
            self._rest += self._in.read() or b""
            if b"\0" not in self._rest:
                time.sleep(0.01)
        message, _, self._rest = self._rest.partition(b"\0")
        return json.loads(message)

    def run(self, script: str):
        """The value of an expression in the page, awaited."""
        found = self.say("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def click(self, selector: str) -> None:
        """Press and release the mouse on the middle of the first element that this selects."""
        x, y = self.run(f"""(() => {{ const one = document.querySelector({json.dumps(selector)});
            one.scrollIntoView({{block: 'center', behavior: 'instant'}});
            const box = one.getBoundingClientRect(); return [box.x + box.width / 2, box.y + box.height / 2]; }})()""")
        for kind in ("mousePressed", "mouseReleased"):
            self.say("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def wait(self, condition: str) -> None:
        """Until this holds in the page."""
        deadline = time.monotonic() + TIMEOUT_S
        while not self.run(condition):
            assert time.monotonic() < deadline, f"it does not come to {condition} within {TIMEOUT_S} s"
            time.sleep(0.05)

    @property
    def bad(self) -> list[str]:
        """Errors, and what the page's policy has forbidden."""
        return self.run("bad")

    @property
    def busy_s(self) -> float:
        """CPU time [s] of the page's own thread so far."""
        return next(one["value"] for one in self.say("Performance.getMetrics")["metrics"] if one["name"] == "TaskDuration")

    @property
    def asked(self) -> int:
        """How many files or addresses the page has asked for."""
        return self.run("performance.getEntriesByType('resource').length")
