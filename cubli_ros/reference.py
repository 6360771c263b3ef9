"""Reference trajectories of the attitude: from a first attitude to the one to hold, at rest at both ends.

Eq. (10) of Aerospace 2022, 9(11), 728, measures the error against a reference that may move. A reference that starts where
the rover is takes the step out of the manoeuvre: the error, the rate error and the torque start near zero.

    angles(t) = final + (first - final) s(t),  s(0) = 1, s' = 0 at the start

*critically damped*: s = (1 + q t) exp(-q t). *minimum jerk* (Flash and Hogan, J. Neurosci. 5, 1985): the fifth-order
polynomial with s' = s'' = 0 at 0 and T. Its largest acceleration is 10/sqrt(3) / T^2; at equal acceleration it arrives in
half the critically damped time, because that one has used its acceleration up at the start.
"""

from flight_math import exp, kernel, same

CONSTANT, CRITICALLY_DAMPED, MINIMUM_JERK = 0, 1, 2


@kernel
def shape(form, t, rate, duration):
    """(s, ds/dt [1/s], d2s/dt2 [1/s^2]) at t [s]; rate q [1/s], duration T [s]. Constant: (0, 0, 0)."""
    if form == CRITICALLY_DAMPED:
        decay = exp(-rate * t)
        return (1.0 + rate * t) * decay, -rate * rate * t * decay, rate * rate * (rate * t - 1.0) * decay
    if form == MINIMUM_JERK and t < duration:
        x = t / duration
        left = 1.0 - x
        s = 1.0 - x * x * x * (10.0 - 15.0 * x + 6.0 * x * x)
        return s, -30.0 * x * x * left * left / duration, -60.0 * x * left * (left - x) / (duration * duration)
    return 0.0, 0.0, 0.0


@kernel
def reference(p, first, t):
    """Reference angles [rad] and their rates [rad/s] at t [s] since the start, from ``first`` to p.reference."""
    if p.reference_form == CONSTANT:
        return p.reference, same(0.0)
    s, slope, _ = shape(p.reference_form, t, p.reference_rate, p.reference_duration)
    way = first - p.reference
    return p.reference + way * s, way * slope
