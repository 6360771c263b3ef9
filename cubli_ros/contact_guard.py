"""A torque of the wheels that keeps the corner on the ground: the demanded one, or the largest part of it that does.

Per mass, the ground's force on the corner is f = a - g, with the centre's acceleration a = omega' x r + omega x
(omega x r) and J omega' = M_g + u - omega x (J omega + J_w Omega), J = Theta - J_w 1 (`cubli_ros.jump_condition`). It
is affine in the torque: f(s u) = f_0 + s f_1. The corner stays where |f_t| <= mu f_n and f_n >= n g, a convex set, so
the s in [0, 1] that are allowed are an interval, and its end is a root of

    (|t_1|^2 - mu^2 n_1^2) s^2 + 2 (t_0.t_1 - mu^2 n_0 n_1) s + |t_0|^2 - mu^2 n_0^2 = 0

or of n_0 + s n_1 = n g, with t and n the parts across and along up. Less torque is allowed because no torque is: a
rover at rest that is let go leans further, and keeps contact until it touches down (docs/faults_rover.md). Where even
that would slip, the torque acts whole if it makes the margin mu f_n - |f_t| larger, and not at all if not.
"""

import math

from cubli_ros.attitude import gravity_torque
from cubli_ros.jump_condition import centre_acceleration
from flight_math import cross, inverse, kernel, maximum, minimum, norm, same


@kernel
def kept_share(p, omega, wheel_speed, up, torque):
    """The largest part s of a torque [N m] that keeps contact; omega, wheel_speed [rad/s]; up: unit vector, body frame.

    p: mass, length, gravity, gravity_sign, inertia (J), wheel_inertia, guard_friction, guard_normal_force.
    """
    gravity = -p.gravity * up
    lever = inverse(p.inertia)
    moment = gravity_torque(p, gravity) - cross(omega, p.inertia @ omega + p.wheel_inertia * wheel_speed)
    force = centre_acceleration(omega, lever @ moment, p.length) - gravity
    more = cross(lever @ torque, same(0.5 * p.length))
    n_0, n_1 = force @ up, more @ up
    t_0, t_1 = force - n_0 * up, more - n_1 * up
    square, least = p.guard_friction * p.guard_friction, p.guard_normal_force * p.gravity
    before = minimum(p.guard_friction * n_0 - norm(t_0), n_0 - least)
    after = minimum(p.guard_friction * (n_0 + n_1) - norm(t_0 + t_1), n_0 + n_1 - least)
    if after >= 0.0:
        return 1.0
    if before < 0.0:
        return 1.0 if after > before else 0.0
    share = 1.0
    if n_0 + n_1 < least:
        share = (least - n_0) / n_1
    a, b, c = t_1 @ t_1 - square * n_1 * n_1, t_0 @ t_1 - square * n_0 * n_1, t_0 @ t_0 - square * n_0 * n_0
    discriminant = b * b - a * c
    if discriminant >= 0.0 and b + math.sqrt(discriminant) > 0.0:
        share = minimum(share, -c / (b + math.sqrt(discriminant)))
    return maximum(share, 0.0)
