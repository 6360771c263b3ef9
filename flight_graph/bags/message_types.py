"""Message definitions as a bag carries them: text to field trees, by the parsers of rosbags.

A definition is one text or several, apart from each other by a line of ``=`` and headed ``MSG: name`` or ``IDL: name``;
the first may come without a head. What a recorder writes for a service or an action is the text of its .srv or .action
file: the types that travel (requests, responses, events, feedback) are made from it.
"""

import re
from functools import lru_cache

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import get_types_from_idl, get_types_from_msg
from rosbags.typesys.base import TypesysError

from flight_graph.bags.errors import BagError
from msg_schemas.definitions import TYPESTORE, Definition, definition

PRIMITIVES = {
    "bool": "?", "byte": "u1", "octet": "u1", "char": "u1", "uint8": "u1", "int8": "i1", "uint16": "u2", "int16": "i2",
    "uint32": "u4", "int32": "i4", "uint64": "u8", "int64": "i8", "float32": "f4", "float64": "f8",
}
WIDE = "wstring"  # UTF-16 text; the parser does not know it
EMPTY = (("structure_needs_at_least_one_member", (Nodetype.BASE, ("uint8", 0))),)  # what ROS sends for no fields
_GROUPS = (["x", "y", "z"], ["x", "y", "z", "w"])
_DEEPEST, _MOST_FIELDS, _LONGEST = 50, 10_000, 1 << 30  # types in each other, fields in all, bytes of a message
_LARGEST, _MOST_SECTIONS = 1 << 20, 1000  # [bytes] of a definition, and types that it spells out
_STAND_IN = "flight_graph_text/msg/Wide"  # takes the place of WIDE for the parser
_RULE = re.compile(r"^=+[ \t]*$", re.M)
_HEAD = re.compile(r"\A\s*(MSG|IDL):[ \t]*([^\s]+)[ \t]*(?:\n|\Z)")


def standard_definition(type_name: str) -> Definition:
    """Definition of a standard type. Raises BagError for an unknown name."""
    try:
        return definition(type_name)
    except ValueError as error:
        raise BagError(str(error)) from None


@lru_cache(maxsize=256)
def field_trees(type_name: str, text: str, encoding: str) -> dict:
    """Type name -> ((field name, node), ...) of a type and all that it contains, from the text in the bag.

    Raises BagError where the text cannot be parsed, or a type that it uses is defined nowhere.
    """
    if len(text) > _LARGEST:
        raise BagError(f"the bag's definition of {type_name} has {len(text)} characters; allowed: at most {_LARGEST}")
    parsed = {}
    if encoding in ("ros2msg", "ros2idl"):
        parsed = _parsed(type_name, text.lstrip("\ufeff").replace("\r\n", "\n").replace("\r", "\n"), encoding)
    known = {name: fields for name, (_, fields) in {**TYPESTORE.fielddefs, **parsed}.items()}
    root = _parser_name(type_name)
    if root not in known:
        raise BagError(f"the bag has no definition of {type_name}" +
                       (f" (schema encoding '{encoding}')" if encoding not in ("ros2msg", "ros2idl", "") else ""))
    trees = {}
    _collect(root, known, trees, ())
    _refuse_extent(type_name, root, trees)
    return {**trees, type_name: trees[root]}


def _parser_name(name):
    """A type's name as the parser has it: all kinds of interfaces are messages to it."""
    package, _, rest = name.partition("/")
    return f"{package}/msg/{rest.rpartition('/')[2]}"


def _parsed(type_name, text, encoding):
    """Type name -> definition in the parser's form, of every section of a text."""
    found, sections = {}, [part for part in _RULE.split(text) if part.strip() or part is text]
    if len(sections) > _MOST_SECTIONS:
        raise BagError(f"the bag's definition of {type_name} spells out {len(sections)} types; allowed: at most "
                       f"{_MOST_SECTIONS}")
    for number, section in enumerate(sections):
        head = _HEAD.match(section)
        name = head[2] if head else type_name
        is_idl = head[1] == "IDL" if head else encoding == "ros2idl"
        body = section[head.end():] if head else section
        try:
            found.update(_idl(body) if is_idl else _msg(name, body.lstrip("\n") if number else body))
        except (TypesysError, RecursionError, ValueError, KeyError, IndexError):
            if not head or name == type_name:
                raise BagError(f"the bag's definition of {type_name} cannot be parsed") from None
    return found


def _idl(body):
    """The types of an .idl text. An enumeration travels as its number."""
    body = re.sub(r"^[ \t]*#.*$", "", body, flags=re.M)  # lines for a preprocessor
    body = re.sub(rf"\bconst\s+{WIDE}(\s+\w+\s*=\s*)L?\"", r'const string\1"', body)
    body = re.sub(r"\benum\s+(\w+)\s*\{[^{}]*\}", r"typedef uint32 \1", body)
    return get_types_from_idl(re.sub(rf"\b{WIDE}\b(?:[ \t]*<[^>]*>)?", _STAND_IN.replace("/", "::"), body))


def _msg(name, body):
    """The types of a .msg, .srv or .action text."""
    parts = re.split(r"^---[ \t]*$", body, flags=re.M)
    parts = [re.sub(rf"^([ \t]*){WIDE}\b(?:<=\d+)?", rf"\g<1>{_STAND_IN}", part, flags=re.M) + "\n" for part in parts]
    base = re.sub(r"(_SendGoal|_GetResult)?(_Event|_Request|_Response)$|_FeedbackMessage$|_(Goal|Result|Feedback)$", "",
                  _parser_name(name))
    if len(parts) == 2:
        types = {f"{base}_Request": parts[0], f"{base}_Response": parts[1], **_event(base)}
    elif len(parts) == 3:
        goal = "unique_identifier_msgs/UUID goal_id\n"
        types = {
            f"{base}_Goal": parts[0], f"{base}_Result": parts[1], f"{base}_Feedback": parts[2],
            f"{base}_FeedbackMessage": f"{goal}{base}_Feedback feedback\n",
            f"{base}_SendGoal_Request": f"{goal}{base}_Goal goal\n",
            f"{base}_SendGoal_Response": "bool accepted\nbuiltin_interfaces/Time stamp\n",
            f"{base}_GetResult_Request": goal, f"{base}_GetResult_Response": f"int8 status\n{base}_Result result\n",
            **_event(f"{base}_SendGoal"), **_event(f"{base}_GetResult")}
    else:
        types = {_parser_name(name): parts[0]}
    found = {}
    for key, text in types.items():
        found.update(get_types_from_msg(text, key))
    return found


def _event(base):
    return {f"{base}_Event": f"service_msgs/ServiceEventInfo info\n{base}_Request[<=1] request\n"
                             f"{base}_Response[<=1] response\n"}


def _collect(name, known, trees, users):
    """Fill trees with a type and all that it contains. users: the types that it stands in. Raises BagError."""
    if name in users:
        raise BagError(f"the bag's definition of {name} contains itself")
    if len(users) >= _DEEPEST:
        raise BagError(f"the bag's definition of {users[0]} nests more than {_DEEPEST} types in each other")
    if name in trees:
        return
    if name not in known:
        raise BagError(f"the definition of {name}, which {users[-1]} contains, is missing from the bag")
    trees[name] = tuple((field, _node(node)) for field, node in known[name]) or EMPTY
    for _, node in trees[name]:
        while node[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE):
            node = node[1][0]
        if node[0] == Nodetype.NAME:
            _collect(node[1], known, trees, (*users, name))


def _refuse_extent(type_name, root, trees):
    """Refuse a type of more numbers, or of more bytes, than a message has. Raises BagError."""
    known = {}

    def extent(name):
        """(fields, least bytes) of a type with all that it contains."""
        if name not in known:
            parts = [of_node(node) for _, node in trees[name]]
            known[name] = sum(fields for fields, _ in parts), sum(size for _, size in parts)
        return known[name]

    def of_node(node):
        kind, argument = node
        if kind == Nodetype.NAME:
            return extent(argument)
        if kind == Nodetype.SEQUENCE:
            return of_node(argument[0])[0], 4
        if kind == Nodetype.ARRAY:
            fields, size = of_node(argument[0])
            return fields, size * argument[1]
        return 1, np.dtype(PRIMITIVES.get(argument[0], "u4")).itemsize

    fields, size = extent(root)
    if fields > _MOST_FIELDS or size > _LONGEST:
        raise BagError(f"the bag's definition of {type_name} has {fields} fields and at least {size} bytes; allowed: at "
                       f"most {_MOST_FIELDS} fields and {_LONGEST} bytes")


def _node(node):
    """A node of the parser, with its stand-in for wide strings replaced."""
    kind, argument = node
    if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        return kind, (_node(argument[0]), argument[1])
    return (Nodetype.BASE, (WIDE, 0)) if kind == Nodetype.NAME and argument == _STAND_IN else node


def vector_group(fields):
    """Return (primitive, length) of a struct x, y, z (w) of one primitive type, else None."""
    if [name for name, _ in fields] in _GROUPS and len({node for _, node in fields}) == 1:
        kind, argument = fields[0][1]
        if kind == Nodetype.BASE and argument[0] in PRIMITIVES:
            return argument[0], len(fields)
    return None


def vector_paths(trees: dict, type_name: str, prefix: str = "") -> set:
    """Dotted paths (without indices) of the x, y, z (w) groups within a type."""
    found = set()
    for field, node in trees[type_name]:
        while node[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE):
            node = node[1][0]
        if node[0] == Nodetype.NAME:
            if vector_group(trees[node[1]]) is not None:
                found.add(f"{prefix}{field}")
            else:
                found |= vector_paths(trees, node[1], f"{prefix}{field}.")
    return found
