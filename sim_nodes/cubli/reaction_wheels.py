"""Three reaction wheels along the cube's axes: limits of torque and speed, and the wheels' own rotation.

Wheel speed Omega [rad/s] is relative to the body. The motor's torque u [N m] acts on the body and -u on the wheel:
J_w (omega' + Omega') = -u (per axis). p: wheel_inertia J_w [kg m^2], torque_limit, speed_limit, period.
"""

from flight_math import clip, kernel


@kernel
def deliverable_torque(p, demand, wheel_speed):
    """Torque the wheels deliver over one period: clipped to the limit, and to what takes a wheel just to its top speed.

    Torque that slows a wheel down is never cut by the speed limit. Large limits mean an ideal wheel.
    """
    highest = clip(p.wheel_inertia * (wheel_speed + p.speed_limit) / p.period, 0.0, p.torque_limit)
    lowest = clip(p.wheel_inertia * (wheel_speed - p.speed_limit) / p.period, -p.torque_limit, 0.0)
    return clip(demand, lowest, highest)


@kernel
def spun(p, wheel_speed, torque, rate_change):
    """Wheel speed one period on: Omega - u h / J_w - (omega(t + h) - omega(t)), exact for a torque that was held."""
    return wheel_speed - torque * p.period / p.wheel_inertia - rate_change
