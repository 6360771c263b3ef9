"""Performance funnels: bounds that shrink in time, the error transform, and its sampled (implicit) form.

Source: Aerospace 2022, 9(11), 728, section 4.1, the definitions after eq. (15) and (16). The second bound's exponent is
misprinted there; both bounds are rho(t) = (rho_0 - rho_inf) exp(l t) + rho_inf with l < 0.

The error e lives in the funnel |e| < rho; xi = e / rho, and eps = xi / (1 - xi^2) grows without limit towards its wall.
"""

import math

from flight_math import count, elementwise, exp, kernel, maximum, minimum, sign, tanh, where

MAXIMUM_ITERATIONS = 80  # [-] more than any b, c of ordinary size needs: each doubles eps or the number of right digits
REARM_THRESHOLD = 0.98  # [-] |xi| at which a bound is widened
REARM_RATIO = 0.75  # [-] |xi| right after widening


@kernel
def performance_bound(elapsed, initial, final, rate):
    """rho(t) = (rho_0 - rho_inf) exp(l t) + rho_inf, in the error's unit; elapsed [s], rate l [1/s] < 0."""
    return (initial - final) * exp(rate * elapsed) + final


@elementwise
def transformed_error(xi):
    """eps = xi / (1 - xi^2); outside of the funnel it changes its sign, and the feedback turns positive."""
    return xi / (1.0 - xi * xi)


@elementwise
def capped_error(xi, cap):
    """eps, continued linearly (C1) beyond |xi| = cap < 1, so that the feedback keeps its sign outside of the funnel."""
    if abs(xi) <= cap:
        return xi / (1.0 - xi * xi)
    room = 1.0 - cap * cap
    value = cap / room + (abs(xi) - cap) * (1.0 + cap * cap) / (room * room)
    return -value if xi < 0.0 else value


@elementwise
def matched_cap(period, gain, bound, largest):
    """Largest xi_m <= `largest` with h lambda eps'(xi_m) / rho <= 1: the sampled loop is still stable there.

    period h [s], gain lambda [error unit / s], bound rho; eps' = (1 + xi^2) / (1 - xi^2)^2. 0 if xi = 0 is too steep.
    """
    ratio = bound / (period * gain)
    if ratio <= 1.0:
        return 0.0
    return minimum(math.sqrt((2.0 * ratio + 1.0 - math.sqrt(8.0 * ratio + 1.0)) / (2.0 * ratio)), largest)


@kernel
def switching_sign(epsilon, smoothing):
    """sgn(eps), with sgn(0) = 0, or tanh(eps / phi) for a smoothing width phi > 0."""
    return tanh(epsilon / smoothing) if smoothing > 0.0 else sign(epsilon)


@elementwise
def implicit_transformed_error(b, c):
    """eps of the sampled funnel: the one root of x(eps) + c eps = b, x = 2 eps / (1 + sqrt(1 + 4 eps^2)), for c > 0.

    x is the normalised error after the step, |x| < 1 for every b, inside the funnel or out. On eps >= 0 the left side
    rises and is concave, so Newton from a lower bound (x <= eps, x < 1) climbs to the root without overshoot; it stops
    when rounding ends the climb.
    """
    size = abs(b)
    epsilon = maximum(size / (1.0 + c), (size - 1.0) / c)
    for _ in range(MAXIMUM_ITERATIONS):
        root = math.sqrt(1.0 + 4.0 * epsilon * epsilon)
        slope = 2.0 / (root * (1.0 + root)) + c
        better = epsilon + (size - 2.0 * epsilon / (1.0 + root) - c * epsilon) / slope
        if not better > epsilon:
            break
        epsilon = better
    return -epsilon if b < 0.0 else epsilon


@elementwise
def normalised_error(epsilon):
    """Inverse of the transform: xi in (-1, 1) with eps = xi / (1 - xi^2)."""
    return 2.0 * epsilon / (1.0 + math.sqrt(1.0 + 4.0 * epsilon * epsilon))


@kernel
def attitude_bound(p, x, t):
    """rho_a(t) [rad], each axis from its own start: rho_0 and 0 s unless `rearm` moved them."""
    return performance_bound(t - x.start_time, x.start_bound, p.rho_a_inf, p.l_a)


@kernel
def rate_bound(p, t):
    """rho_u(t) [rad/s]."""
    return performance_bound(t, p.rho_u0, p.rho_u_inf, p.l_u)


@kernel
def rearm(p, x, t, error):
    """Widen a bound rho_a that the error e_a is about to leave: if |e| / rho >= 0.98, restart it at rho = |e| / 0.75.

    For the attitude funnel only: a slow, wide rate funnel loses the attitude.
    """
    near = abs(error) >= REARM_THRESHOLD * attitude_bound(p, x, t)
    x.start_bound = where(near, abs(error) / REARM_RATIO, x.start_bound)
    x.start_time = where(near, t, x.start_time)
    x.rearmed += count(near)
