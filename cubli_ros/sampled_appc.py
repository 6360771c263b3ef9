"""APPC for a sampled loop: the demand for which the error one sample later satisfies the law (backward Euler).

Ours; the law is that of `cubli_ros.appc`. Its error transform has a root inside of the funnel for every measurement, so
leaving the funnel is harmless, and the switching term gets a dead zone instead of a chatter. With the period h, per axis,

    x + c eps(x) = b - kappa sgn(b),   c = h lambda / rho,   kappa = h k v / rho

where b is the error over the bound, one sample ahead, if nothing were demanded.
"""

from cubli_ros.attitude import body_rates, cardan_rates
from cubli_ros.funnel import attitude_bound, implicit_transformed_error, rate_bound
from cubli_ros.reference import reference
from flight_math import elementwise, kernel, sign, sincos, where


@elementwise
def implicit_epsilon(b, dead_zone, c):
    """The root eps of the equation above; zero in the dead zone |b| <= kappa."""
    return 0.0 if abs(b) <= dead_zone else implicit_transformed_error(b - sign(b) * dead_zone, c)


@kernel
def implicit_feedback(h, b, bound, gain, switching):
    """eps, and the feedback lambda eps + sgn(b) k v; in the dead zone it takes the error to zero in one sample.

    h [s]: the period; switching: k v.
    """
    dead_zone = h * switching / bound
    epsilon = implicit_epsilon(b, dead_zone, h * gain / bound)
    return epsilon, where(abs(b) <= dead_zone, b * bound / h, gain * epsilon + sign(b) * switching)


@kernel
def implicit_attitude_loop(p, x, predicted, target, target_rate, bound):
    """Sampled eq. (15): eps_a, and the virtual rate Gamma_a(t + h) [rad/s].

    predicted: angles [rad] one sample ahead, if the rates stayed; target, its rate and the bound: at t + h.
    """
    b = (predicted - target) / bound
    epsilon, feedback = implicit_feedback(p.period, b, bound, p.lambda_a, p.k_a * x.adaptive_a)
    return epsilon, body_rates(sincos(predicted), target_rate - feedback)


@kernel
def implicit_rate_loop(p, x, omega, virtual_rate, bound):
    """Sampled eq. (16): eps_u, and the acceleration [rad/s^2] that puts omega(t + h) where the law wants it."""
    b = (omega - virtual_rate) / bound
    epsilon, feedback = implicit_feedback(p.period, b, bound, p.lambda_u, p.k_u * x.adaptive_u)
    return epsilon, -feedback


@kernel
def sampled_law(p, x, t, angles, turn, omega):
    """Both loops at t + h, from what is measured at t: eps_a, eps_u, acceleration [rad/s^2]; the virtual rate into x."""
    ahead = t + p.period
    predicted = angles + p.period * cardan_rates(turn, omega)
    target, target_rate = reference(p, x.first, ahead)
    epsilon_a, x.virtual_rate = implicit_attitude_loop(p, x, predicted, target, target_rate, attitude_bound(p, x, ahead))
    epsilon_u, acceleration = implicit_rate_loop(p, x, omega, x.virtual_rate, rate_bound(p, ahead))
    return epsilon_a, epsilon_u, acceleration
