"""Names of components, and paths that begin with one: ``controller.lambda_a``, ``rover_a.controller.lambda_a``.

A name is one word, or, of a component of an included vehicle, words with dots between them: the vehicle's and its own. Over
ROS the words are parts of a name: the component ``rover_a.controller`` is the node ``/rover_a/controller``.
"""

import re

WORD = re.compile("[A-Za-z][A-Za-z0-9_]{0,99}")
_PORT = re.compile("[A-Za-z_][A-Za-z0-9_]{0,99}")
ALLOWED = "a letter, then letters, digits and underscores, 100 in all"


def is_word(text: str) -> bool:
    """Whether a text is a name of one word."""
    return WORD.fullmatch(text) is not None


def is_port(text: str) -> bool:
    """Whether a text is a name of an input or an output."""
    return _PORT.fullmatch(text) is not None


def split(path: str, known) -> tuple[str, str]:
    """The name that a path begins with, and the rest behind its dot. known: all names that there are.

    Of a path that begins with none of them, as much as would be a name: the words of a vehicle that is there and the next
    one, or the first word.
    """
    words, above = path.split("."), 1
    for count in range(1, len(words) + 1):
        name = ".".join(words[:count])
        if name in known:
            return name, ".".join(words[count:])
        if any(one.startswith(f"{name}.") for one in known):
            above = count + 1
    return ".".join(words[:above]), ".".join(words[above:])


def joined(namespace: str, name: str) -> str:
    """A name as it is called from outside of a namespace."""
    return f"{namespace}.{name}" if namespace and name else namespace or name


def ros(name: str) -> str:
    """A name as ROS writes it, relative: ``rover_a/controller``."""
    return name.replace(".", "/")
