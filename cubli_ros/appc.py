"""Adaptive prescribed performance control (APPC) of the Cubli rover's attitude, as the paper prints it.

Source: Aerospace 2022, 9(11), 728, equations (10)-(16). Units SI; angles are Cardan 1-2-3 [rad], rates are body rates.
Two cascaded funnels, rho_a for the attitude error and rho_u for the rate error:

    (10)        e_a = angles - reference          xi_a = e_a / rho_a     eps_a = xi_a / (1 - xi_a^2)
    (11), (15)  Gamma_a = -G^-1 (lambda_a eps_a + sgn(eps_a) k_a v_a)    v_a' = eta_a |eps_a|
    (12)        e_u = omega - Gamma_a             xi_u = e_u / rho_u     eps_u = xi_u / (1 - xi_u^2)
    (16)        u = -I (lambda_u eps_u + sgn(eps_u) k_u v_u)             v_u' = eta_u |eps_u|

(13) and (14) are the rates of e_a and e_u, which no law needs. A reference that moves adds its rate to (15). In the paper
I is the scalar m l^2 / 6; for a rover with wheels it is Theta - J_w 1, about the corner. p, x: parameters and state of
`cubli_ros.appc_controller`. The law's sampled form is in `cubli_ros.sampled_appc`.
"""

from cubli_ros.attitude import body_rates
from cubli_ros.funnel import switching_sign, transformed_error
from flight_math import kernel, minimum, where


@kernel
def attitude_loop(p, x, turn, xi, reference_rate):
    """Eq. (15): eps_a, and the virtual rate Gamma_a [rad/s]; reference_rate [rad/s] of the Cardan angles."""
    epsilon = transformed_error(xi)
    feedback = p.lambda_a * epsilon + switching_sign(epsilon, p.smoothing) * p.k_a * x.adaptive_a
    return epsilon, body_rates(turn, reference_rate - feedback)


@kernel
def rate_loop(p, x, xi):
    """Eq. (16): eps_u, and the angular acceleration u / I [rad/s^2]."""
    epsilon = transformed_error(xi)
    feedback = p.lambda_u * epsilon + switching_sign(epsilon, p.smoothing) * p.k_u * x.adaptive_u
    return epsilon, -feedback


@kernel
def torque_demand(p, acceleration, gravity_torque):
    """u = I acceleration - f M_g [N m]; feed_forward f: 1 cancels gravity, 0 is eq. (16)."""
    return p.inertia @ acceleration - p.feed_forward * gravity_torque


@kernel
def adapted(h, adaptive, rate, epsilon, xi, largest):
    """Second line of eq. (15), (16) by forward Euler over h [s]: v + h eta |eps|, at most `largest`.

    An axis with |xi| >= 1 stands still: there eps says nothing about the disturbance.
    """
    grown = minimum(adaptive + h * rate * abs(epsilon), largest)
    return where(abs(xi) < 1.0, grown, adaptive)
