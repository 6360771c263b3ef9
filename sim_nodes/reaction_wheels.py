"""Three reaction wheels along the cube's axes: limits of torque and speed, and the wheels' own rotation.

Wheel speed Omega is relative to the body. The motor's torque u acts on the body and -u on the wheel:
J_w (omega' + Omega') = -u (per axis). All arrays (3,); torque [N m], speed [rad/s], wheel inertia J_w [kg m^2].
"""

from flight_graph.kernel import kernel


@kernel
def deliverable_torque(demand, wheel_speed, torque_limit, speed_limit, wheel_inertia, period, out):
    """Torque the wheels deliver over one period [s]: clipped to +-torque_limit, and to what takes a wheel just to its
    top speed.

    Torque that slows a wheel down is never cut by the speed limit. Limits are scalars; large ones mean an ideal wheel.
    Returns how many axes were clipped.
    """
    clipped = 0
    for i in range(3):
        highest = wheel_inertia * (wheel_speed[i] + speed_limit) / period
        lowest = wheel_inertia * (wheel_speed[i] - speed_limit) / period
        if highest > torque_limit:
            highest = torque_limit
        if highest < 0.0:
            highest = 0.0
        if lowest < -torque_limit:
            lowest = -torque_limit
        if lowest > 0.0:
            lowest = 0.0
        out[i] = demand[i]
        if demand[i] > highest:
            out[i] = highest
            clipped += 1
        elif demand[i] < lowest:
            out[i] = lowest
            clipped += 1
    return clipped


@kernel
def spin(torque, rate_change, wheel_inertia, period, wheel_speed):
    """Advance wheel_speed in place over one period: Omega += -u h / J_w - (omega(t + h) - omega(t)).

    torque was held for the period; rate_change (3,) [rad/s] is the body's. Exact for a held torque.
    """
    for i in range(3):
        wheel_speed[i] = wheel_speed[i] - torque[i] * period / wheel_inertia - rate_change[i]
