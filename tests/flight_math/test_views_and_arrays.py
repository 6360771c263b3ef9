"""Views of records, rows of arrays, work arrays on the stack: compiled and plain alike; no heap, no copies of records."""

import re
import typing

import numpy as np

from flight_math import (
    NO_KINDS,
    DualVector,
    Kinds,
    Mat,
    Mat3,
    Quaternion,
    Vec,
    Vec3,
    View,
    cross,
    kernel,
    mat3,
    norm,
    plain,
    quaternion4,
    rotate,
    stack_array,
    vec3,
    view,
)

STAMP = [("sec", "<i4"), ("nanosec", "<u4")]
LAYOUT = np.dtype([
    ("v", "f8", (3,)), ("m", "f8", (3, 3)), ("q", "f8", (4,)), ("w", "f8", (7,)), ("j", "f8", (2, 6)), ("t", "f8", (6,)),
    ("g", "f8", (5, 4)), ("rows", "f8", (4, 3)), ("blocks", "f8", (2, 2, 3, 3)), ("nines", "f8", (3, 9)), ("long", "f8", (36,)),
    ("s", "f8"), ("i", "i8"), ("b", "?"), ("words", "i8", (4,)),
    ("nested", [("stamp", STAMP), ("u", "f8", (3,)), ("z", "f8"), ("free", "f8", (3,))])], align=True)
KINDS = Kinds.of([("v", Vec3), ("m", Mat3), ("q", Quaternion), ("w", Vec(7)), ("j", Mat(2, 6)), ("t", DualVector),
                  ("nested.u", Vec3)])


class Tree(typing.NamedTuple):
    axis: np.ndarray
    turn: Quaternion
    place: Vec3


@kernel
def carried(tree, i):
    return rotate(tree.turn, vec3(tree.axis[i])) + tree.place


@kernel
def work(p, x, n):
    """Every way to read and store."""
    x.v = x.v + 2.0 * p.s * x.nested.u
    x.m = 2.0 * x.m
    x.q = x.q * p.q
    x.w = x.w + 1.0
    x.j = x.j * 3.0
    x.t = cross(x.t, p.t)
    x.i += 1
    x.b = x.i > 0
    x.s = x.i
    x.nested.z = norm(x.v)
    x.nested.u = vec3(x.nested.free)
    x.nested.free[1] = 4.0
    x.nested.stamp.sec += 1
    x.words[2] = x.i + 3
    for i in range(x.g.shape[0]):
        x.g[i, 0] += float(i)
    x.g[2] = p.q
    for i in range(n):
        x.rows[i] = vec3(x.rows[i]) + x.v
        x.blocks[0, 1] = mat3(x.blocks[i % 2, 1]) + p.m
    x.blocks[1][0] = p.m
    x.nines[1] = Vec(9)(mat3(x.nines[0]) @ p.m)
    scratch = stack_array(n, 3)
    fixed = stack_array(36)
    for i in range(n):
        scratch[i] = vec3(p.rows[n - 1 - i])
        fixed[3 * i:3 * i + 3] = vec3(scratch[i])
    x.long = fixed
    x.w = fixed[5:12]
    x.rows[0] = vec3(scratch[:, 1][:3])
    x.g = stack_array(5, 4)
    tree = Tree(p.rows, p.q, x.v)
    x.v = carried(tree, 2)
    return quaternion4(x.g[2]), vec3(scratch[1]), scratch.shape[0], tree.place


def records():
    """Two records with numbers in every field."""
    made = np.zeros(2, LAYOUT)
    draw = np.random.default_rng(3)
    for name in LAYOUT.names[:11]:
        made[name] = draw.normal(size=made[name].shape)
    made["s"], made["nested"]["u"], made["nested"]["free"] = 0.5, draw.normal(size=(2, 3)), draw.normal(size=(2, 3))
    return made


def test_views_compiled_and_plain_are_equal():
    first, second = records(), records()
    found = work(View(first[0], KINDS), View(first[1], KINDS), 4)
    expected = plain(work)(*(View(second.view(np.recarray)[i], KINDS) for i in range(2)), 4)
    assert first.tobytes() == second.tobytes()
    assert repr(found) == repr(expected)


@kernel
def whole(records):
    """Views made in a kernel."""
    x = view(records[1], KINDS)
    nothing = view(records[0], NO_KINDS)
    x.v = vec3(nothing.v) + 1.0
    return view(x, KINDS).v


def test_a_view_is_made_in_a_kernel_and_without_kinds_arrays_are_by_reference():
    made = records()
    expected = made["v"][0] + 1.0
    assert whole(made).parts() == tuple(expected)
    assert made["v"][1].tolist() == expected.tolist()


def test_no_heap_and_no_copy_of_a_record():
    """The machine code counts no references, allocates nothing, and copies no more than the longest field."""
    work(*(View(record, KINDS) for record in records()), 4)
    code = "\n".join(work.inspect_llvm().values())
    assert "NRT_" not in code
    sizes = [int(size) for size in re.findall(r"memcpy[^\n]*i64 (\d+), i1", code)]
    assert max(sizes, default=0) <= max(LAYOUT[name].itemsize for name in ("long", "blocks"))


@kernel
def beyond(records, index):
    return view(records[0], KINDS).v[index]


def test_a_run_time_index_counts_from_either_end():
    made = records()
    assert [beyond(made, i) for i in (0, 2, -1)] == [made["v"][0][i] for i in (0, 2, -1)]
