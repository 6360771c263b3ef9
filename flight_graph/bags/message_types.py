"""Message definitions as a bag carries them: text to field trees, by the parsers of rosbags."""

from functools import lru_cache

from rosbags.interfaces import Nodetype
from rosbags.typesys import get_types_from_idl, get_types_from_msg
from rosbags.typesys.base import TypesysError

from flight_graph.bags.errors import BagError
from msg_schemas.definitions import TYPESTORE, Definition, definition

PRIMITIVES = {
    "bool": "?", "byte": "u1", "octet": "u1", "char": "u1", "uint8": "u1", "int8": "i1", "uint16": "u2", "int16": "i2",
    "uint32": "u4", "int32": "i4", "uint64": "u8", "int64": "i8", "float32": "f4", "float64": "f8",
}
EMPTY = (("structure_needs_at_least_one_member", (Nodetype.BASE, ("uint8", 0))),)  # what ROS sends for no fields
_GROUPS = (["x", "y", "z"], ["x", "y", "z", "w"])


def standard_definition(type_name: str) -> Definition:
    """Definition of a standard type. Raises BagError for an unknown name."""
    try:
        return definition(type_name)
    except ValueError as error:
        raise BagError(str(error)) from None


@lru_cache(maxsize=256)
def field_trees(type_name: str, text: str, encoding: str) -> dict:
    """Type name -> ((field name, node), ...) of a type and all that it contains, from the text in the bag."""
    try:
        if encoding == "ros2msg":
            parsed = get_types_from_msg(text, type_name)
        elif encoding == "ros2idl":
            parsed = get_types_from_idl(text)
        elif type_name in TYPESTORE.fielddefs:
            parsed = {}
        else:
            raise BagError(f"the bag has no definition of {type_name} (schema encoding '{encoding}')")
    except TypesysError as error:
        raise BagError(f"the bag's definition of {type_name} cannot be parsed: {str(error).splitlines()[0]}") from error
    known = {name: fields for name, (_, fields) in {**TYPESTORE.fielddefs, **parsed}.items()}
    return {name: tuple(fields) or EMPTY for name, fields in known.items()}


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
