"""The words of the compiler, put as a person would: types by their names in the component, functions by their signs."""

import re

from flight_graph.components.component import kinds_of
from flight_graph.components.findings import nearest

_SIGNS = {"add": "+", "sub": "-", "mul": "*", "truediv": "/", "floordiv": "//", "mod": "%", "matmul": "@", "pow": "**",
          "lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "==", "ne": "!=", "and_": "&", "or_": "|", "iadd": "+=",
          "isub": "-=", "imul": "*=", "itruediv": "/=", "neg": "-"}
_NUMBERS = re.compile(r"\b(?:float(?:32|64)|u?int(?:8|16|32|64)|intp|Literal\[int\]\((-?\d+)\))")
_WORDS = ((r"\bboolean\b|Literal\[bool\]\(\w+\)", "truth"), (r"\bnone\b|NoneType", "nothing"),
          (r"unicode_type|Literal\[str\]\([^)]*\)", "text"), (r"CPUDispatcher\(<function (\w+) at 0x\w+>\)", r"kernel \1"),
          (r"<function (\w+) at 0x\w+>", r"\1"), (r"<built-in function (\w+)>", r"\1"), (r"type\((kernel \w+)\)", r"\1"),
          (r"array\(([^,()]+), (\d)d, \w+(?:, \w+)*\)", r"array with \2 indices"), (r"with 1 indices", "with 1 index"))
_NOISE = re.compile(r"^(?:Failed in |During: |File \"|- Resolution failure|There (?:is|are) \d|Enable logging|This error |"
                    r"\s*$)")


def essence(text: str, component) -> str:
    """The first statement of numba's text, in plain words."""
    text = _named_records(text, component)
    for pattern, words in _FORMS:
        found = re.search(pattern, text)
        if found:
            return words(found, component)
    lines = [line.strip() for line in text.splitlines() if not _NOISE.match(line)]
    return _shortened(plain_types(lines[0] if lines else "the compiler does not take this"))


def plain_types(text: str) -> str:
    """A text of numba's with its types in words."""
    text = _NUMBERS.sub(lambda found: found[1] or "number", text)
    for pattern, word in _WORDS:
        text = re.sub(pattern, word, text)
    text = re.sub(r"UniTuple\(([^()]+) x (\d+)\)", r"tuple of \2 \1s", text)
    return re.sub(r"\bTuple\(", "tuple of (", text)


def _shortened(text):
    return text if len(text) < 300 else text[:297] + "..."


# -- records ---------------------------------------------------------------------------------------------------------
def _named_records(text, component):
    """Numba's names of views, and its long descriptions of records, replaced by what the component calls them."""
    for view, name in _views(component).items():
        text = text.replace(view, name)
    text = re.sub(r"View\(\w+\)", "record", text)
    known = {component.parameters.dtype.names: "p", component.state.dtype.names: "x"}
    known.update({signal.dtype.names: port for port, signal in {**component.inputs, **component.outputs}.items()})
    while (found := re.search(r"Record\(", text)) is not None:
        end = _closing(text, found.end())
        names = _top_names(text[found.end():end])
        title = known.get(names, f"record of {', '.join(names)}" if names else "record")
        text = text[:found.start()] + title + text[end + 1:]
    return text


def _views(component):
    """Numba's names of the views of a component's records."""
    from numba.np.numpy_support import from_dtype

    from flight_math.values.compiled_views import ViewType
    ports = {**component.inputs, **component.outputs}
    records = {"p": (component.parameters.dtype, component.parameters.kinds),
               "x": (component.state.dtype, component.state.kinds),
               **{port: (signal.dtype, kinds_of(signal)) for port, signal in ports.items()}}
    return {ViewType(from_dtype(dtype), kinds).name: name for name, (dtype, kinds) in records.items()}


def _closing(text, start):
    depth = 1
    for at in range(start, len(text)):
        depth += {"(": 1, ")": -1}.get(text[at], 0)
        if depth == 0:
            return at
    return len(text) - 1


def _top_names(body):
    """The fields of a record's description, without those of the records inside."""
    depth, names, word = 0, [], ""
    for sign in body:
        if sign == "[" and depth == 0:
            names.append(word.strip(", ;"))
            word = ""
        depth += {"[": 1, "(": 1, "]": -1, ")": -1}.get(sign, 0)
        word = word + sign if depth == 0 and sign not in "[]()" else ""
    return tuple(names)


# -- forms of numba's messages ------------------------------------------------------------------------------------------
def _attribute(found, component):
    owner = plain_types(found[2].strip())
    known = {"p": component.parameters.dtype.names, "x": component.state.dtype.names,
             **{port: signal.dtype.names for port, signal in {**component.inputs, **component.outputs}.items()}}
    hint = f"; {nearest(found[1], known[owner])}" if owner in known else ""
    return f"{_a(owner)} has no '.{found[1]}'{hint}"


def _call(found, component):
    name, arguments = found[1], plain_types(found[2].strip())
    parts = _parted(arguments)
    if name in _SIGNS and len(parts) == 2:
        return f"{parts[0]} {_SIGNS[name]} {parts[1]} is not defined"
    if name in ("getitem", "static_getitem", "setitem", "static_setitem"):
        if parts[0].startswith("tuple of ("):
            return f"the entries of a {parts[0]} are of different kinds: an index must be a constant"
        return f"{_a(parts[0])} has no element [{parts[1] if len(parts) > 1 else ''}] that could be read or set"
    return f"{name}({arguments}) is not defined for these kinds"


def _parted(text):
    parts, depth = [""], 0
    for sign in text:
        depth += {"(": 1, ")": -1}.get(sign, 0)
        if sign == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += sign
    return [part.strip() for part in parts]


def _a(words):
    """A kind with its article."""
    article = "an" if words[:1] in "aeiou" else "a"
    return f"{article} {words}" if words in ("number", "truth", "text") or words.startswith("array") else words


_FORMS = (
    (r"Unknown attribute '(\w+)' of type ([^\n]+)", _attribute),
    (r"No implementation of function [^\n]*?found for signature:\s*>>> (\w+)\(([^\n]*)\)", _call),
    (r"Invalid use of getiter with parameters \(([^\n]*)\)",
     lambda found, _: f"a loop cannot run over {_a(plain_types(found[1]))}; write range(...)"),
    (r"failed to unpack ([^\n]+)", lambda found, _: f"{_a(plain_types(found[1]))} cannot be taken apart into names"),
    (r"Cannot unify ([^\n]+?) and ([^\n]+?) for '(\w+?)(?:\.\d+)?'",
     lambda found, _: f"'{found[3]}' is {_a(plain_types(found[1]))} at one place and {_a(plain_types(found[2]))} at "
                      "another; give it one kind"),
    (r"Can't unify return type from the following types: ([^\n]+)",
     lambda found, _: f"it returns different kinds at different places: {plain_types(found[1])}; return one kind"),
    (r"(missing a required argument: '\w+'|too many positional arguments|got an unexpected keyword argument '\w+'|"
     r"not enough arguments[^\n]*)", lambda found, _: f"the call does not fit the kernel's arguments: {found[1]}"),
    (r"[Uu]ntyped global name '(\w+)'[^\n]*?(?:type of (?:<class ')?([\w.]+))?[^\n]*",
     lambda found, _: f"'{found[1]}' is nothing that a kernel can use; it uses kernels, numbers, tuples of numbers, and "
                      "functions of flight_math"),
    (r"Use of unsupported opcode \((\w+)\)", lambda found, _: f"this statement is not for kernels ({found[1].lower()})"),
    (r"(?:cannot type infer|type inference failed for|Type of) [^\n]*recursi[^\n]*",
     lambda found, _: "a kernel calls itself without an end that the compiler could see; write a loop"),
    (r"[Vv]ariable '?(\w+?)(?:\.\d+)?'? (?:is )?referenced before assignment",
     lambda found, _: f"'{found[1]}' is read before it has a value"),
    (r"(?:Undecided|Cannot determine|Cannot infer) [^\n]*?type[^\n]*?'?(\w+)?'?",
     lambda found, _: "the kind of a name cannot be told here; give it a value of one kind before it is read"),
)
