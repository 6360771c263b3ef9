"""Errors of the mathematics: what a kernel may not do, in one sentence, with the place in its source."""

import sys
from pathlib import Path

_OWN = str(Path(__file__).parent)


class KernelError(TypeError):
    """A kernel does what is not allowed.

    file, line: place in the kernel's source ("" and 0 where it is not known). sentence: what is wrong and what is allowed.
    Numba passes it on as it is, for it is none of numba's own errors.
    """

    def __init__(self, file: str, line: int, sentence: str):
        super().__init__(file, line, sentence)
        self.file, self.line, self.sentence = file, line, sentence

    def __str__(self):
        return f"{self.file}:{self.line}: {self.sentence}" if self.file else self.sentence


def refuse(sentence: str):
    """Raise KernelError with the line that plain Python is at: the innermost one outside of this package."""
    frame = sys._getframe(1)
    while frame is not None and frame.f_code.co_filename.startswith(_OWN):
        frame = frame.f_back
    if frame is None:
        raise KernelError("", 0, sentence)
    raise KernelError(frame.f_code.co_filename, frame.f_lineno, sentence)
