"""The kinds of values: immutable rows of numbers, each kind a class of its own.

    Vec3(x, y, z)                   three numbers of one frame
    Mat3(xx, xy, xz, yx, ...)       3 x 3, row by row
    Quaternion(x, y, z, w)          scalar last
    Vec(n), Mat(n, m)               a class for each size; Vec(3) is Vec3, Mat(3, 3) is Mat3
    DualQuaternion(real, dual)      two Quaternions, q + eps q'
    DualVector(real, dual)          two Vec3, v + eps v' (twistors, twists, wrenches)
    Mask                            truths, what a comparison of vectors gives

In a compiled kernel a value is a row of registers (`flight_math.values.compiled_types`); in plain Python it is the tuple
of Python's floats below. Components that are read are NumPy scalars, whose division by zero gives inf as it does compiled.
"""

import copyreg
import sys

import numpy as np

from flight_math.errors import refuse

_REAL = (float, int, np.floating, np.integer)

class ValueClass(type):
    """Class of the classes of values, by which records and the compiler know them."""

    def __call__(cls, *items):
        return cls.made(items)

    def __repr__(cls):
        return cls.title


class Value(tuple, metaclass=ValueClass):
    """Base: ``count`` numbers, seen from outside in the form ``shape``."""

    __slots__ = ()
    __array_ufunc__ = None  # a NumPy scalar on the left leaves the operation to __rmul__ and its like
    count = 0  # numbers
    shape = ()  # form in a record
    title = "Value"  # name in sentences
    letters = ""  # names of components
    halves = None  # class of the two attributes real and dual

    @classmethod
    def made(cls, items):
        """A value of numbers, of halves, or of the elements of one array."""
        if len(items) == 1 and isinstance(items[0], np.ndarray) and items[0].shape in (cls.shape, (cls.count,)):
            return cls.of(items[0].ravel().tolist())
        if len(items) == 1 and isinstance(items[0], Value) and items[0].count == cls.count:
            return cls.of(items[0].parts())
        if cls.halves is not None and len(items) == 2 and all(type(item) is cls.halves for item in items):
            return cls.of((*items[0].parts(), *items[1].parts()))
        none = (Value, np.ndarray, str)
        if len(items) == cls.count and not cls.halves and not any(isinstance(item, none) for item in items):
            return cls.of(items)
        return refuse(cls.call_refused([kind_name(kind_of(item)) for item in items]))

    @classmethod
    def call_refused(cls, names) -> str:
        """The sentence for a class that is called with arguments of these kinds."""
        need = f"two {cls.halves.title}, real and dual" if cls.halves else f"{cls.count} numbers"
        return f"{cls.title}({', '.join(names)}): needed are {need}, or one array of {cls.count}"

    @classmethod
    def of(cls, numbers):
        """A value of its numbers in order."""
        return tuple.__new__(cls, map(cls.item, numbers))

    @staticmethod
    def item(number):
        """A component as it is kept: a Python float; numbers of other kinds (symbols, complex) as they are."""
        return number if type(number) is float else float(number) if isinstance(number, _REAL) else number

    def parts(self):
        """The numbers in order, a tuple of Python's floats."""
        return tuple(tuple.__iter__(self))

    def __iter__(self):
        return map(_read, tuple.__iter__(self))

    def __getitem__(self, at):
        return _read(tuple.__getitem__(self, self.place(at)))

    @classmethod
    def place(cls, at):
        """Position of an index among the numbers."""
        if isinstance(at, (int, np.integer)) and len(cls.shape) == 1:
            if not -cls.count <= at < cls.count:
                refuse(f"[{at}] is outside of a {cls.title}, whose components are 0 to {cls.count - 1}")
            return int(at % cls.count)
        if len(cls.shape) == 2 and isinstance(at, tuple) and len(at) == 2:
            for index, length in zip(at, cls.shape):
                if not -length <= index < length:
                    refuse(f"[{at[0]}, {at[1]}] is outside of a {cls.title}")
            return int(at[0] % cls.shape[0] * cls.shape[1] + at[1] % cls.shape[1])
        return refuse(f"a {cls.title} is read as {'m[i, j]' if len(cls.shape) == 2 else 'v[i]'} with whole numbers")

    def __setitem__(self, at, value):
        refuse(immutable(type(self)))

    def __setattr__(self, name, value):
        refuse(immutable(type(self)))

    def __getattr__(self, name):
        cls = type(self)
        if cls.halves is not None and name in ("real", "dual"):
            half = self.parts()[:cls.halves.count] if name == "real" else self.parts()[cls.halves.count:]
            return cls.halves.of(half)
        if len(name) == 1 and name in cls.letters:
            return _read(tuple.__getitem__(self, cls.letters.index(name)))
        if name.startswith("_") or name == "py_func":  # what numba and `fingerprint` ask of any global
            raise AttributeError(name)
        return refuse(no_attribute(cls, name))

    def __array__(self, dtype=None, copy=None):
        return np.array(self.parts(), dtype).reshape(self.shape)

    def __bool__(self):
        refuse(no_truth(type(self)))

    def __repr__(self):
        return f"{type(self).title}({', '.join(map(repr, self.parts()))})"

    __hash__ = tuple.__hash__


def _read(item):
    return np.float64(item) if isinstance(item, float) else item


def no_attribute(cls, name) -> str:
    """The sentence for an attribute that a kind of value has not."""
    known = [*(f".{letter}" for letter in cls.letters), *((".real", ".dual") if cls.halves else ())]
    index = "[i, j]" if len(cls.shape) == 2 else "[i]"
    return f"a {cls.title} has no .{name}; it has {', '.join([*known, index])}"


def immutable(kind) -> str:
    """The sentence for a component that is set."""
    return f"a {kind.title} is a value: its components cannot be set; make a new {kind.title} and assign that"


def no_truth(kind) -> str:
    """The sentence for a value in the place of a truth."""
    if is_mask(kind):
        return "a comparison of vectors gives several truths, not one: write any(...) or all(...)"
    return f"a {kind.title} is no truth: compare it, and write any(...) or all(...)"


def kind_name(kind) -> str:
    """A kind in words: ``float`` is a number."""
    if isinstance(kind, str):
        return kind
    words = {float: "number", int: "whole number", bool: "truth", np.ndarray: "array"}
    return words.get(kind) or getattr(kind, "title", getattr(kind, "__name__", str(kind)))


def described(items) -> str:
    """Arguments by their kinds, for sentences."""
    return f"({', '.join(kind_name(kind_of(item)) for item in items)})"


def kind_of(item):
    """Kind of an object of plain Python: a class of values, float (a number), bool (a truth), or its own type."""
    if isinstance(item, (Value, float)):
        return type(item) if isinstance(item, Value) else float
    if isinstance(item, (bool, np.bool_)):
        return bool
    if isinstance(item, np.ndarray):
        return np.ndarray
    return float if isinstance(item, _REAL) or (hasattr(item, "__sub__") and hasattr(item, "__mul__")) else type(item)


class Vec3(Value):
    """x, y, z."""

    __slots__ = ()
    count, shape, title, letters = 3, (3,), "Vec3", "xyz"


class Quaternion(Value):
    """x, y, z, w: the scalar part is the last."""

    __slots__ = ()
    count, shape, title, letters = 4, (4,), "Quaternion", "xyzw"


class Mat3(Value):
    """Nine numbers, row by row; ``m[i, j]``."""

    __slots__ = ()
    count, shape, title = 9, (3, 3), "Mat3"


class DualQuaternion(Value):
    """q + eps q': ``real`` and ``dual``, two Quaternions; (8,) in a record, real first, each x, y, z, w."""

    __slots__ = ()
    count, shape, title, halves = 8, (8,), "DualQuaternion", Quaternion


class DualVector(Value):
    """v + eps v': ``real`` and ``dual``, two Vec3; (6,) in a record, real first."""

    __slots__ = ()
    count, shape, title, halves = 6, (6,), "DualVector", Vec3


class Mask(Value):
    """Three truths: any(mask), all(mask), count(mask), where(mask, a, b), ~ & |."""

    __slots__ = ()
    count, shape, title, item = 3, (3,), "Mask", bool

    def __iter__(self):
        return tuple.__iter__(self)


def _sized(name: str, base, **attributes):
    """The class called ``name`` of this module, made at its first use; found again by name when it is unpickled."""
    module = sys.modules[__name__]
    if name not in vars(module):
        attributes |= {"__slots__": (), "__module__": __name__, "__qualname__": name}
        setattr(module, name, ValueClass(name, (base,), attributes))
    return vars(module)[name]


def Vec(count: int):  # noqa: N802
    """The class of vectors of ``count`` numbers; a law names it once, ``Vec7 = Vec(7)``."""
    if count == 3:
        return Vec3
    return _sized(f"Vec{count}", Value, count=count, shape=(count,), title=f"Vec({count})")


def Mat(rows: int, columns: int):  # noqa: N802
    """The class of matrices of ``rows`` x ``columns`` numbers, row by row."""
    if (rows, columns) == (3, 3):
        return Mat3
    return _sized(f"Mat{rows}x{columns}", Value, count=rows * columns, shape=(rows, columns),
                  title=f"Mat({rows}, {columns})")


def mask_of(count: int):
    """The class of ``count`` truths."""
    return Mask if count == 3 else _sized(f"Mask{count}", Mask, count=count, shape=(count,), title=f"Mask({count})")


def __getattr__(name):
    """Vec7, Mat6x6, Mask7: the classes of sizes, by name."""
    for prefix, make in (("Vec", Vec), ("Mat", Mat), ("Mask", mask_of)):
        sizes = name.removeprefix(prefix).split("x")
        if name.startswith(prefix) and all(size.isdigit() for size in sizes) and len(sizes) == 1 + (make is Mat):
            return make(*map(int, sizes))
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


copyreg.pickle(ValueClass, lambda kind: kind.__qualname__)


def _again(kind, numbers):
    return kind.of(numbers)


def _reduce(value):
    return _again, (type(value), value.parts())


Value.__reduce__ = _reduce


def is_vector(kind) -> bool:
    """Whether a kind is Vec3 or Vec(n)."""
    return isinstance(kind, ValueClass) and kind.__name__.startswith("Vec") and kind.__name__[3:].isdigit()


def is_matrix(kind) -> bool:
    """Whether a kind is Mat3 or Mat(n, m)."""
    return isinstance(kind, ValueClass) and len(kind.shape) == 2


def is_mask(kind) -> bool:
    """Whether a kind is a Mask."""
    return isinstance(kind, ValueClass) and issubclass(kind, Mask)
