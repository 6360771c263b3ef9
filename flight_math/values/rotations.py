"""Functions of quaternions and dual quaternions; each is written once, for plain Python and for the compiler.

A unit quaternion q = (x, y, z, w) turns v into q v q*: with q the attitude of B in A, rotate(q, v in B) is v in A.
"""

from flight_math.values.classes import DualQuaternion, DualVector, Mat3, Quaternion, Vec3
from flight_math.values.operation import operation
from flight_math.values.symbols import choose

_ONE_QUATERNION = "needed is a Quaternion"
_TURNING = "needed are a Quaternion and a Vec3"


def _turn(a, b):
    return Vec3 if (a, b) == (Quaternion, Vec3) else None


@operation(lambda q: q if q in (Quaternion, DualQuaternion) else None, "needed is a Quaternion or DualQuaternion")
def conjugate(q):
    """q*, the inverse of a unit quaternion; of a DualQuaternion, both halves."""
    return tuple(part if i % 4 == 3 else -part for i, part in enumerate(q))


def _turned(x, y, z, w, v):
    """v + 2 w (u x v) + 2 u x (u x v) with u = (x, y, z)."""
    a = 2.0 * (y * v[2] - z * v[1])
    b = 2.0 * (z * v[0] - x * v[2])
    c = 2.0 * (x * v[1] - y * v[0])
    return v[0] + w * a + (y * c - z * b), v[1] + w * b + (z * a - x * c), v[2] + w * c + (x * b - y * a)


@operation(_turn, _TURNING)
def rotate(q, v):
    """q v q* for a unit quaternion."""
    return _turned(q[0], q[1], q[2], q[3], v)


@operation(_turn, _TURNING)
def rotate_back(q, v):
    """q* v q for a unit quaternion."""
    return _turned(-q[0], -q[1], -q[2], q[3], v)


@operation(lambda q: Vec3 if q is Quaternion else None, _ONE_QUATERNION)
def vector_part(q):
    """(x, y, z)"""
    return q[:3]


@operation(lambda v, w: Quaternion if (v, w) == (Vec3, float) else None, "needed are a Vec3 and a number")
def quaternion(v, w):
    """The quaternion of a vector part and a scalar part."""
    return *v, w


@operation(lambda q: Mat3 if q is Quaternion else None, _ONE_QUATERNION)
def rotation_matrix(q):
    """R(q) with R v = q v q*, for a unit quaternion."""
    x, y, z, w = q
    return (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y),
            2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x),
            2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))


@operation(lambda q: q if q in (Quaternion, DualQuaternion) else None, "needed is a Quaternion or DualQuaternion")
def short_way(q):
    """q, or -q where its (real) scalar part is negative: the same rotation by at most half a turn."""
    return tuple(choose(q[3] < 0.0, -part, part) for part in q)


@operation(lambda v: DualQuaternion if v is DualVector else None, "needed is a DualVector")
def dual_quaternion(v):
    """The dual quaternion whose two vector parts are v, scalar parts zero."""
    return *v[:3], 0.0, *v[3:], 0.0


@operation(lambda q: DualVector if q is DualQuaternion else None, "needed is a DualQuaternion")
def dual_vector_part(q):
    """The two vector parts of a dual quaternion."""
    return *q[:3], *q[4:7]
