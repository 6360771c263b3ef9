"""Performance funnels: bounds that shrink in time, the error transform, and its sampled (implicit) form.

Source: Aerospace 2022, 9(11), 728, section 4.1, the definitions after eq. (15) and (16). The second bound's exponent is
misprinted there; both bounds are rho(t) = (rho_0 - rho_inf) exp(l t) + rho_inf with l < 0.

The error e lives in the funnel |e| < rho; xi = e / rho, and eps = xi / (1 - xi^2) grows without limit towards its wall.
"""

import math

from flight_graph.kernel import kernel

MAXIMUM_ITERATIONS = 80  # [-] more than any b, c of ordinary size needs: each doubles eps or the number of right digits
REARM_THRESHOLD = 0.98  # [-] |xi| at which a bound is widened
REARM_RATIO = 0.75  # [-] |xi| right after widening


@kernel
def performance_bound(elapsed, initial, final, rate):
    """rho(t) = (rho_0 - rho_inf) exp(l t) + rho_inf, in the error's unit; elapsed [s], rate l [1/s] < 0."""
    return (initial - final) * math.exp(rate * elapsed) + final


@kernel
def transformed_error(xi, cap):
    """eps = xi / (1 - xi^2), continued linearly (C1) beyond |xi| = cap; cap >= 1 gives the formula as printed.

    As printed, eps changes sign outside the funnel and the feedback turns positive; a cap below 1 prevents that.
    """
    if cap >= 1.0 or abs(xi) <= cap:
        return xi / (1.0 - xi * xi)
    room = 1.0 - cap * cap
    beyond = abs(xi) - cap
    value = cap / room + beyond * (1.0 + cap * cap) / (room * room)
    if xi < 0.0:
        return -value
    return value


@kernel
def matched_cap(period, gain, bound, largest):
    """Largest xi_m <= `largest` with h lambda eps'(xi_m) / rho <= 1: the sampled loop is still stable there.

    period h [s], gain lambda [error unit / s], bound rho; eps' = (1 + xi^2) / (1 - xi^2)^2. 0 if xi = 0 is too steep.
    """
    ratio = bound / (period * gain)
    if ratio <= 1.0:
        return 0.0
    cap = math.sqrt((2.0 * ratio + 1.0 - math.sqrt(8.0 * ratio + 1.0)) / (2.0 * ratio))
    if cap > largest:
        return largest
    return cap


@kernel
def switching_sign(epsilon, smoothing):
    """sgn(eps), with sgn(0) = 0, or tanh(eps / phi) for a smoothing width phi > 0."""
    if smoothing > 0.0:
        return math.tanh(epsilon / smoothing)
    if epsilon > 0.0:
        return 1.0
    if epsilon < 0.0:
        return -1.0
    return 0.0


@kernel
def implicit_transformed_error(b, c):
    """eps of the sampled funnel: the one root of x(eps) + c eps = b, x = 2 eps / (1 + sqrt(1 + 4 eps^2)), for c > 0.

    x is the normalised error after the step, |x| < 1 for every b, inside the funnel or out. On eps >= 0 the left side
    rises and is concave, so Newton from a lower bound (x <= eps, x < 1) climbs to the root without overshoot; it stops
    when rounding ends the climb.
    """
    size = abs(b)
    epsilon = size / (1.0 + c)
    if (size - 1.0) / c > epsilon:
        epsilon = (size - 1.0) / c
    for _ in range(MAXIMUM_ITERATIONS):
        root = math.sqrt(1.0 + 4.0 * epsilon * epsilon)
        slope = 2.0 / (root * (1.0 + root)) + c
        better = epsilon + (size - 2.0 * epsilon / (1.0 + root) - c * epsilon) / slope
        if not better > epsilon:
            break
        epsilon = better
    if b < 0.0:
        return -epsilon
    return epsilon


@kernel
def normalised_error(epsilon):
    """Inverse of the transform: xi in (-1, 1) with eps = xi / (1 - xi^2)."""
    return 2.0 * epsilon / (1.0 + math.sqrt(1.0 + 4.0 * epsilon * epsilon))


@kernel
def rearm(elapsed, error, final, rate, start_bound, start_time):
    """Widen a bound that the error is about to leave: if |e| / rho >= 0.98, restart it at rho = |e| / 0.75.

    All arrays (3,). start_bound and start_time [s] are the funnel's own initial value and start (rho_0 and 0 at first)
    and are changed in place. Returns how many axes were widened. Meant for the attitude funnel only: a slow, wide rate
    funnel loses the attitude.
    """
    widened = 0
    for i in range(3):
        bound = performance_bound(elapsed - start_time[i], start_bound[i], final[i], rate[i])
        if abs(error[i]) >= REARM_THRESHOLD * bound:
            start_bound[i] = abs(error[i]) / REARM_RATIO
            start_time[i] = elapsed
            widened += 1
    return widened
