"""A page in a real browser without a screen and without a network: what it tells after a script has clicked about in it."""

import re
import shutil
import subprocess
from html import unescape

import pytest

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
LISTENER = """
for (const kind of ['error', 'unhandledrejection', 'securitypolicyviolation'])
  window.addEventListener(kind, e => document.body.dataset.bad = kind + ' ' + (e.message || e.reason || e.blockedURI));
"""
_TELLER = """
const tell = (name, value) => document.body.dataset[name] = JSON.stringify(value);
window.addEventListener('load', async () => {
  try { %s } catch (error) { document.body.dataset.bad = error.stack; }
  tell('asked', performance.getEntriesByType('resource').length);
});
"""


def opened(folder, text: str, script: str) -> tuple[dict[str, str], str]:
    """What a page told, by name, and its document at the end. folder: a new one; text: of the page; script: the body of an
    asynchronous function that clicks, and tells by ``tell(name, value)``. Skips the test where there is no browser."""
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        pytest.skip(f"no browser is installed here ({', '.join(BROWSERS)}): apt-get install chromium brings one")
    page = folder / "page.html"
    page.write_text(text.replace("<style>", f"<script>{LISTENER}</script><style>", 1).replace(
        "</body>", f"<script>{_TELLER % script}</script></body>"), encoding="utf-8")
    done = subprocess.run(
        [browser, "--headless=new", "--no-sandbox", "--enable-unsafe-swiftshader", "--no-first-run",
         "--disable-background-networking", "--host-resolver-rules=MAP * ~NOTFOUND", f"--user-data-dir={folder / 'profile'}",
         "--window-size=1280,1600", "--virtual-time-budget=20000", "--dump-dom", f"file://{page}"],
        capture_output=True, text=True, timeout=240)
    assert "<body" in done.stdout, done.stderr[-2000:]
    body = re.search(r"<body[^>]*>", done.stdout)[0]
    return {name: unescape(value) for name, value in re.findall(r'data-(\w+)="([^"]*)"', body)}, done.stdout
