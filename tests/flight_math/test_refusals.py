"""What may not be written with values is refused in one sentence with file and line, compiled and in plain Python alike."""

import linecache
import pickle

import numpy as np
import pytest

import flight_math
from flight_math import KernelError, Kinds, Quaternion, Vec3, View, identity3, kernel, plain

LAYOUT = np.dtype([("adaptive", "f8", (3,)), ("q", "f8", (4,)), ("g", "f8", (5, 4)), ("s", "f8"), ("n", [("u", "f8", (3,))])],
                  align=True)
KINDS = Kinds.of([("adaptive", Vec3), ("q", Quaternion), ("n.u", Vec3)])

BOTH = {  # statement -> sentence, the same compiled and plain
    "a + q": "Vec3 + Quaternion is not defined; allowed with a Vec3: another Vec3 and a number",
    "m * a": "Mat3 * Vec3 is not defined; a product of matrices is written @; allowed with * is a number",
    "q * a": "Quaternion * Vec3 is not defined; a vector is turned by rotate(q, v); allowed with a Quaternion are a Quaternion "
             "and a number",
    "a @ q": "Vec3 @ Quaternion is not defined; allowed are Vec3 @ Vec3 (the dot product), Mat3 @ Vec3, Mat3 @ Mat3, and "
             "Mat(n, m) with what fits it",
    "q < q": "Quaternion < Quaternion is not defined; compared are vectors of one kind, or a vector and a number",
    "m / m": "Mat3 / Mat3 is not defined; allowed with a Mat3: a number",
    "(a < b) + 1.0": "Mask + number is not defined; allowed with truths: & | ~, any(...), all(...), count(...), where(...)",
    "1.0 if a < b else 0.0": "a comparison of vectors gives several truths, not one: write any(...) or all(...)",
    "1.0 if not (a < b) else 0.0": "a comparison of vectors gives several truths, not one: write any(...) or all(...)",
    "1.0 if a else 0.0": "a Vec3 is no truth: compare it, and write any(...) or all(...)",
    "a.w": "a Vec3 has no .w; it has .x, .y, .z, [i]",
    "m.x": "a Mat3 has no .x; it has [i, j]",
    "a[3]": "[3] is outside of a Vec3, whose components are 0 to 2",
    "m[0]": "a Mat3 is read as m[i, j] with whole numbers",
    "a ** 2": "** does not take values (Vec3, number); write v * v, or power(v, n)",
    "float(a)": "float does not take values (Vec3); write one component, v.x or v[i]",
    "cross(a, q)": "cross(Vec3, Quaternion): needed are two Vec3, or two DualVector",
    "cross(a)": "cross(Vec3): needed are two Vec3, or two DualVector",
    "clip(a, q, 1.0)": "clip(Vec3, Quaternion, number): needed are a vector and two bounds, each a vector of its kind or a number; "
                       "or three numbers",
    "where(a, a, b)": "where(Vec3, Vec3, Vec3): needed are a Mask (a comparison of vectors) and two vectors or numbers, or a truth "
                      "and two of one kind",
    "Vec3(1.0, 2.0)": "Vec3(number, number): needed are 3 numbers, or one array of 3",
    "DualQuaternion(q, a)": "DualQuaternion(Quaternion, Vec3): needed are two Quaternion, real and dual, or one array of 8",
    "sin(q)": "sin(Quaternion): needed are numbers and vectors of one kind",
    "vec3(1.0)": "vec3(number): needed is an array (3,)",
    "x.adaptve": "there is no 'adaptve' here; did you mean adaptive? There are: adaptive, q, g, s, n",
    "x.n.v": "there is no 'v' here; there are: u",
    "stack_array(1.5)": "stack_array(number): needed are one to four whole numbers",
    "x.adaptive = x.q": "'adaptive' is a Vec3, and a Quaternion is assigned to it",
    "x.adaptive = 1.0": "'adaptive' is a Vec3, and a number is assigned to it",
    "x.s = a": "'s' is a number, and a Vec3 is assigned to it",
    "x.s = a < b": "'s' is a number, and a Mask is assigned to it",
    "x.n = x.n": "'n' is a nested record: assign its fields one by one",
    "x.g = a": "'g' holds 5 x 4 numbers, and 3 are assigned to it",
    "x.adaptive[0] = 1.0": "a Vec3 is a value: its components cannot be set; make a new Vec3 and assign that",
    "x.adaptive.x = 1.0": "a Vec3 is a value: its components cannot be set; make a new Vec3 and assign that",
    "x.nothere = 1.0": "there is no 'nothere' here; there are: adaptive, q, g, s, n",
    "rk4(decay, 1.0, 0.0, q, 0.1)": "the slope returns Vec3 for a state Quaternion: the rate has the form of the state",
}
COMPILED = {  # plain Python would compute these, or says it in its own words
    "max(a)": "max does not take values (Vec3); write largest(v), or maximum(a, b) by component",
    "sum(a)": "sum does not take values (Vec3); write total(v)",
    "np.dot(a, b)": "np.dot does not take values (Vec3, Vec3); write a @ b",
    "np.sin(a)": "np.sin does not take values (Vec3); write sin(v) of flight_math",
    "math.sin(a)": "math.sin does not take values (Vec3); write sin(v) of flight_math",
    "x.g[0, 0] = a": "a Vec3 does not fit an array of 2 dimensions at this index: it fills 3 float64 numbers",
    "x.g[0] = m": "a Mat3 does not fit an array of 2 dimensions at this index: it fills 3 x 3 float64 numbers; for a row of 9 write "
                  "Vec(9)(m)",
}


@kernel
def decay(given, t, state):
    return Vec3(1.0, 2.0, 3.0)


def written(statement):
    """A function of one statement on line 3 of a file that only linecache has."""
    assigns = " = " in statement
    text = f"def law(a, b, m, q, x):\n    z = 1.0\n    {statement if assigns else f'return {statement}'}\n    return z\n"
    name = f"/written/{abs(hash(statement))}.py"
    linecache.cache[name] = (len(text), None, text.splitlines(True), name)
    scope = {**vars(flight_math), "decay": decay, "np": np, "math": __import__("math")}
    exec(compile(text, name, "exec"), scope)
    return scope["law"], name


def arguments():
    return (Vec3(1.0, 2.0, 3.0), Vec3(0.0, 1.0, 1.0), identity3(), Quaternion(0.0, 0.0, 0.0, 1.0),
            View(np.zeros(1, LAYOUT)[0], KINDS))


def refusal(function):
    with pytest.raises(KernelError) as caught:
        function(*arguments())
    return caught.value


@pytest.mark.parametrize("statement", [*BOTH, *COMPILED])
def test_refused_when_compiled(statement):
    law, name = written(statement)
    error = refusal(kernel(law))
    assert error.sentence == (BOTH | COMPILED)[statement]
    if "rk4" not in statement:
        assert (error.file, error.line) == (name, 3)
        assert str(error) == f"{name}:3: {error.sentence}"


@pytest.mark.parametrize("statement", BOTH)
def test_refused_in_plain_python_with_the_same_sentence(statement):
    law, name = written(statement)
    error = refusal(law)
    assert error.sentence == BOTH[statement]
    if "rk4" not in statement:
        assert (error.file, error.line) == (name, 3)


def test_the_place_is_that_of_the_inner_kernel():
    inner, name = written("a + q")
    inner = kernel(inner)
    outer = kernel(lambda a, b, m, q, x: inner(a, b, m, q, x))
    assert refusal(outer).file == name


def test_a_kernel_error_is_a_type_error_that_can_be_sent():
    error = pickle.loads(pickle.dumps(KernelError("law.py", 3, "no")))
    assert isinstance(error, TypeError) and (error.file, error.line, error.sentence) == ("law.py", 3, "no")


def test_plain_is_what_was_written():
    law, _ = written("a + b")
    assert plain(kernel(law)) is law
