"""Keys of a terminal while something plays: one at a time, without return; nothing where there is no terminal."""

import os
import select
import sys
import termios
import tty

ARROWS = {b"\x1b[A": "up", b"\x1b[B": "down", b"\x1b[C": "right", b"\x1b[D": "left"}


class Keyboard:
    """``with Keyboard() as keys: keys.pressed()`` gives the next key: a letter, 'space', 'up', 'right', ...; or None."""

    def __init__(self):
        self.is_there = sys.stdin is not None and sys.stdin.isatty()

    def __enter__(self):
        if self.is_there:
            self._file = sys.stdin.fileno()
            self._before = termios.tcgetattr(self._file)
            tty.setcbreak(self._file)  # Ctrl-C still interrupts
        return self

    def __exit__(self, *_):
        if self.is_there:
            termios.tcsetattr(self._file, termios.TCSADRAIN, self._before)

    def pressed(self) -> str | None:
        """The next key that was pressed, or None."""
        if not self.is_there or not select.select([self._file], [], [], 0.0)[0]:
            return None
        raw = os.read(self._file, 1)
        if raw == b"\x1b" and select.select([self._file], [], [], 0.01)[0]:
            raw += os.read(self._file, 2)
        if not raw:
            self.is_there = False  # the terminal is gone
            return None
        return ARROWS.get(raw) or ("space" if raw == b" " else raw.decode("latin-1").lower())
