"""Adaptive prescribed performance control (APPC) of the Cubli rover's attitude.

Source: Aerospace 2022, 9(11), 728, equations (10)-(16). Units SI; angles are Cardan 1-2-3 [rad], rates are body rates.
Two cascaded funnels: |e_a| < rho_a on the attitude error, |e_u| < rho_u on the rate error.

*Explicit form*, as printed: `attitude_loop` (15) and `rate_loop` (16), with the adaptive gains by forward Euler.
*Implicit form*: `implicit_attitude_loop` and `implicit_rate_loop` choose the demand for which the error one sample
later satisfies the law (backward Euler). Its error transform has a root inside the funnel for every measurement, so
leaving the funnel is harmless, and the switching term gets a dead zone instead of a chatter. Both share the rest; one
sample is

    bounds -> attitude loop -> rate loop -> torque_demand (I acceleration - M_g) -> limit_torque -> adapt.

In the paper I is the scalar I0 = m l^2 / 6; for a rover with wheels it is Theta - J_w 1, about the corner. All arrays
are (3,) float64 unless said; outputs do not alias inputs.
"""

from cubli_ros.attitude import body_rates, cardan_rates
from cubli_ros.funnel import (
    implicit_transformed_error,
    performance_bound,
    switching_sign,
    transformed_error,
)
from flight_graph.kernel import kernel
from flight_graph.vectors import matrix_vector


@kernel
def attitude_bounds(elapsed, start_bound, start_time, final, rate, out):
    """rho_a(t) per axis [rad], from each axis's own start: rho_0 and 0 [s] unless `funnel.rearm` moved them."""
    for i in range(3):
        if (
            i > 0
            and start_bound[i] == start_bound[i - 1]
            and start_time[i] == start_time[i - 1]
            and final[i] == final[i - 1]
            and rate[i] == rate[i - 1]
        ):
            out[i] = out[i - 1]
        else:
            out[i] = performance_bound(elapsed - start_time[i], start_bound[i], final[i], rate[i])


@kernel
def rate_bounds(elapsed, initial, final, rate, out):
    """rho_u(t) per axis [rad/s]; elapsed [s] since the start."""
    for i in range(3):
        if i > 0 and initial[i] == initial[i - 1] and final[i] == final[i - 1] and rate[i] == rate[i - 1]:
            out[i] = out[i - 1]
        else:
            out[i] = performance_bound(elapsed, initial[i], final[i], rate[i])


@kernel
def attitude_loop(
    angles, reference, reference_rate, bound, gain, switching_gain, adaptive, smoothing, cap, error, xi, epsilon,
    virtual_rate
):
    """Eq. (10), (15): virtual rate Gamma_a = G^-1 (-lambda_a eps_a - sgn(eps_a) k_a v_a + reference rate) [rad/s].

    In: angles, reference [rad], reference_rate [rad/s] (zero in the paper), bound rho_a(t) [rad], gain lambda_a
    [rad/s], switching_gain k_a, adaptive v_a, smoothing phi (scalar, 0: hard sgn), cap of |xi| (>= 1: as printed).
    Out: error e_a [rad], xi, epsilon, virtual_rate delta [rad/s].
    """
    for i in range(3):
        error[i] = angles[i] - reference[i]
        xi[i] = error[i] / bound[i]
        epsilon[i] = transformed_error(xi[i], cap[i])
        feedback = gain[i] * epsilon[i] + switching_sign(epsilon[i], smoothing) * switching_gain[i] * adaptive[i]
        virtual_rate[i] = reference_rate[i] - feedback
    x, y, z = body_rates(angles, virtual_rate[0], virtual_rate[1], virtual_rate[2])
    virtual_rate[0] = x
    virtual_rate[1] = y
    virtual_rate[2] = z


@kernel
def rate_loop(
    omega, virtual_rate, bound, gain, switching_gain, adaptive, smoothing, cap, error, xi, epsilon, acceleration
):
    """Eq. (12), (16): angular acceleration demand -lambda_u eps_u - sgn(eps_u) k_u v_u [rad/s^2].

    In: omega, virtual_rate [rad/s], bound rho_u(t) [rad/s], gain lambda_u [rad/s^2], and as in `attitude_loop`.
    Out: error e_u [rad/s], xi, epsilon, acceleration.
    """
    for i in range(3):
        error[i] = omega[i] - virtual_rate[i]
        xi[i] = error[i] / bound[i]
        epsilon[i] = transformed_error(xi[i], cap[i])
        feedback = gain[i] * epsilon[i] + switching_sign(epsilon[i], smoothing) * switching_gain[i] * adaptive[i]
        acceleration[i] = -feedback


@kernel
def implicit_feedback(b, bound, gain, switching, period):
    """One axis of the sampled funnel: (eps, feedback).

    x + c eps(x) = b - kappa sgn(b) with c = h lambda / rho, kappa = h k v / rho.
    b: error over bound one sample ahead if nothing were demanded; switching: k v. Inside the dead zone |b| <= kappa the
    feedback takes the error to zero in one sample: eps = 0, feedback = b rho / h.
    """
    dead_zone = period * switching / bound
    if abs(b) <= dead_zone:
        return 0.0, b * bound / period
    if b > 0.0:
        epsilon = implicit_transformed_error(b - dead_zone, period * gain / bound)
        return epsilon, gain * epsilon + switching
    epsilon = implicit_transformed_error(b + dead_zone, period * gain / bound)
    return epsilon, gain * epsilon - switching


@kernel
def implicit_attitude_loop(
    angles,
    omega,
    reference,
    reference_rate,
    bound,
    gain,
    switching_gain,
    adaptive,
    period,
    predicted,
    epsilon,
    virtual_rate,
):
    """Sampled form of eq. (15): the virtual rate delta(t + h) [rad/s] for the attitude predicted one sample ahead.

    angles, omega: measured at t; reference, reference_rate, bound: at t + h; period h [s].
    Out: predicted angles + h G omega [rad], epsilon, virtual_rate.
    """
    phi_rate, theta_rate, psi_rate = cardan_rates(angles, omega[0], omega[1], omega[2])
    predicted[0] = angles[0] + period * phi_rate
    predicted[1] = angles[1] + period * theta_rate
    predicted[2] = angles[2] + period * psi_rate
    for i in range(3):
        b = (predicted[i] - reference[i]) / bound[i]
        epsilon[i], feedback = implicit_feedback(b, bound[i], gain[i], switching_gain[i] * adaptive[i], period)
        virtual_rate[i] = reference_rate[i] - feedback
    x, y, z = body_rates(predicted, virtual_rate[0], virtual_rate[1], virtual_rate[2])
    virtual_rate[0] = x
    virtual_rate[1] = y
    virtual_rate[2] = z


@kernel
def implicit_rate_loop(omega, virtual_rate, bound, gain, switching_gain, adaptive, period, epsilon, acceleration):
    """Sampled form of eq. (16): acceleration demand [rad/s^2] that puts omega(t + h) where the law wants it.

    omega: measured at t; virtual_rate, bound: at t + h. Out: epsilon, acceleration.
    """
    for i in range(3):
        switching = switching_gain[i] * adaptive[i]
        b = (omega[i] - virtual_rate[i]) / bound[i]
        epsilon[i], feedback = implicit_feedback(b, bound[i], gain[i], switching, period)
        acceleration[i] = -feedback


@kernel
def normalise(value, target, bound, error, xi):
    """error = value - target and xi = error / bound, per axis.

    For the implicit form: e_u(t) is measured against the virtual rate chosen for t one sample earlier. Call it before
    the loops overwrite that rate; before the first sample `attitude_loop` gives the rate to start from.
    """
    for i in range(3):
        error[i] = value[i] - target[i]
        xi[i] = error[i] / bound[i]


@kernel
def torque_demand(inertia, acceleration, gravity_torque, feed_forward, out):
    """u = I acceleration - f M_g [N m]; inertia (3, 3) [kg m^2]; feed_forward f: 1 cancels gravity, 0 is eq. (16)."""
    x, y, z = matrix_vector(inertia, acceleration[0], acceleration[1], acceleration[2])
    out[0] = x - feed_forward * gravity_torque[0]
    out[1] = y - feed_forward * gravity_torque[1]
    out[2] = z - feed_forward * gravity_torque[2]


@kernel
def limit_torque(demand, limit, out):
    """Clip each axis to +-limit [N m]. Returns whether any axis was clipped."""
    clipped = False
    for i in range(3):
        out[i] = demand[i]
        if demand[i] > limit:
            out[i] = limit
            clipped = True
        elif demand[i] < -limit:
            out[i] = -limit
            clipped = True
    return clipped


@kernel
def adapt(period, rate, epsilon, xi, frozen, largest, adaptive):
    """Second half of eq. (15), (16) by forward Euler: v += h eta |eps| in place.

    An axis stands still while `frozen` (the torque is clipped) or |xi| >= 1: there eps says nothing about the
    disturbance. `largest` bounds v; rho_u_inf / (8 k_a) for v_a keeps its switching small against the rate funnel.
    """
    for i in range(3):
        if not frozen and abs(xi[i]) < 1.0:
            adaptive[i] = adaptive[i] + period * rate[i] * abs(epsilon[i])
            if adaptive[i] > largest:
                adaptive[i] = largest
