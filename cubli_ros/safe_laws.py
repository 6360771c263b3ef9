"""The laws of the rover's safe states, which need no more than a rate, and what a lost wheel leaves of them.

*Hold* kills the rates and keeps the attitude it was entered at, turned ever since by theta (rotation vector, by the
rates):

    u = -J (d omega + k theta)

Gravity does not enter: it pulls with at most m g r theta_tilt, which leans the rover by m g r sin(tilt) / (J k) more,
4 % of the tilt for k = 0.25 1/s^2 on g = 0.002 m/s^2. So hold works without any attitude.

*Rest* lets the rover down to the side it leans to, about the axis e (level, through the corner) at a rate w:

    u = J d (w e - omega)

Gravity ends it: J omega' = m g r sin(tilt) - J d (omega - w), a rate of w + m g r sin(tilt) / (J d) once the lag 1/d
has passed, which is slower than falling and touches down at l times it. If e points the wrong way, the rover goes
over the top and down on the other side. Once it lies still the wheels are braked, u = J_w b Omega, limited to a
torque that does not tip it: less than m g l / 2, gravity's about an edge of the face it lies on.

*A lost wheel* i gives the torque T_i, whatever it is told. The centre of mass moves by the torque across the body
diagonal [1, 1, 1] alone, so the other wheels give u = tau - (tau_i - T_i) [1, 1, 1]: the whole, with T_i, has the
wanted torque across the diagonal, and what is wrong lies along it. There the rover is left to spin.
"""

from flight_math import Vec3, clip, kernel, largest, maximum


@kernel
def hold_torque(p, omega, turned):
    """Torque [N m] that kills the rates omega [rad/s] and brings back what the rover has turned [rad]."""
    return -(p.inertia @ (p.hold_damping * omega + p.hold_stiffness * turned))


@kernel
def rest_torque(p, omega, axis):
    """Torque [N m] that lets the rover down about a unit axis of the body."""
    return p.inertia @ (p.rest_damping * (p.rest_rate * axis - omega))


@kernel
def brake_torque(p, wheel_speed):
    """Torque [N m] on the body that brakes the wheels slowly: exponentially, and no faster than brake_limit allows."""
    return clip(p.wheel_inertia * p.brake_rate * wheel_speed, -p.brake_limit, p.brake_limit)


@kernel
def without_wheel(torque, lost, delivered):
    """Torques [N m] of the wheels with the same part across the diagonal, though wheel ``lost`` gives ``delivered``."""
    wrong = 0.0
    for axis in range(3):
        if lost == axis:
            wrong = torque[axis] - delivered[axis]
    left = torque - wrong
    return Vec3(0.0 if lost == 0 else left.x, 0.0 if lost == 1 else left.y, 0.0 if lost == 2 else left.z)


@kernel
def within(torque, limit):
    """A torque with no axis beyond a limit [N m], in the same direction."""
    return torque * (limit / maximum(limit, largest(abs(torque))))
