"""Adaptive control of base attitude and joints (Slotine and Li) on the estimated parameters.

Source: Aerospace 2023, 10(10), 679, equations (31)-(33), (38). Errors and gains have 3+n elements: attitude, joints.
Attitude error by quaternion: dq = q^-1 q_d, e = 2 sgn(dq0) dq_v (body axes). References:
w_r = dR w_d + Lambda e, al_r = dR w_d_dot - w x (dR w_d) + Lambda e_dot, likewise for joints;
sigma = [w_r - w, thd_r - thd]; u = Y(theta, v, v_r, v_r_dot) pi_hat + K_D sigma.

The base's translation is not commanded: its reference acceleration a_r is the one that makes the estimated force on
the system vanish, a_r = -f0(pi_hat) / M_hat. At pi_hat = pi this is Slotine-Li on the system without linear momentum.
"""

from flight_graph.kernel import kernel
from spacerobot_ros.dynamics import inverse_dynamics
from spacerobot_ros.kinematics import attitude_difference, rotation_matrix

SLOTINE_LI = 0  # Y(theta, v, v_r, v_r_dot): the form that has a proof
PRINTED = 1  # Y(theta, v_r, v_r_dot) of equation (38): reference velocities in both places
ACTUAL = 2  # Y(theta, v, v_r_dot): actual velocities in both places
DESIRED_FEEDFORWARD = 3  # v_r, v_r_dot := desired motion, sigma := e + Lambda e_dot (a reading that fits Fig. 10)

PREDICTED = 0  # a_r from the estimated force rows
MEASURED = 1  # a_r := accelerometer of the previous control period


def control_work_size(joints: int) -> int:
    """Length of the flat work array of `adaptive_control`."""
    return 18 * (joints + 1) + 6 + joints + 25


@kernel
def attitude_error(q, w, q_d, w_d, wdot_d, error, error_rate, rate, acceleration, difference, matrix):
    """Attitude error (3,) and its rate, and the desired rate and acceleration (3,) in body axes (without Lambda terms).

    Work: ``difference`` (4,), ``matrix`` (3, 3).
    """
    attitude_difference(q, q_d, difference)
    rotation_matrix(difference, matrix)
    sign = 1.0 if difference[0] >= 0.0 else -1.0
    for k in range(3):
        rate[k] = matrix[k, 0] * w_d[0] + matrix[k, 1] * w_d[1] + matrix[k, 2] * w_d[2]
        error[k] = 2.0 * sign * difference[1 + k]
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        turned = matrix[k, 0] * wdot_d[0] + matrix[k, 1] * wdot_d[1] + matrix[k, 2] * wdot_d[2]
        acceleration[k] = turned - (w[i] * rate[j] - w[j] * rate[i])
        cross = (rate[i] - w[i]) * difference[1 + j] - (rate[j] - w[j]) * difference[1 + i]
        error_rate[k] = sign * (difference[0] * (rate[k] - w[k]) + cross)


@kernel
def reference_motion(
    form, q, w, theta, thd, q_d, w_d, wdot_d, theta_d, thd_d, thdd_d, gain, sigma, base_signals, joint_signals, work
):
    """Errors to reference signals, equations (32), (33). ``gain``: Lambda, (3+n,) [1/s].

    ``sigma`` (3+n,) [rad/s]. ``base_signals`` (4, 3): the w, w_r, al_r of `regressor` (row 3, a_r, is left alone);
    ``joint_signals`` (3, n): its thd, thd_r, thdd_r. Work: (25,).
    """
    error = work[0:3]
    error_rate = work[3:6]
    rate = work[6:9]
    acceleration = work[9:12]
    attitude_error(
        q, w, q_d, w_d, wdot_d, error, error_rate, rate, acceleration, work[12:16], work[16:25].reshape((3, 3))
    )
    feedforward = form == DESIRED_FEEDFORWARD
    for k in range(3):
        reference = rate[k]
        acceleration_reference = acceleration[k]
        if feedforward:
            sigma[k] = error[k] + gain[k] * error_rate[k]
        else:
            reference += gain[k] * error[k]
            acceleration_reference += gain[k] * error_rate[k]
            sigma[k] = reference - w[k]
        base_signals[0, k] = reference if form == PRINTED else w[k]
        base_signals[1, k] = w[k] if form == ACTUAL else reference
        base_signals[2, k] = acceleration_reference
    for i in range(theta.shape[0]):
        difference = theta_d[i] - theta[i]
        difference_rate = thd_d[i] - thd[i]
        reference = thd_d[i]
        acceleration_reference = thdd_d[i]
        if feedforward:
            sigma[3 + i] = difference + gain[3 + i] * difference_rate
        else:
            reference += gain[3 + i] * difference
            acceleration_reference += gain[3 + i] * difference_rate
            sigma[3 + i] = reference - thd[i]
        joint_signals[0, i] = reference if form == PRINTED else thd[i]
        joint_signals[1, i] = thd[i] if form == ACTUAL else reference
        joint_signals[2, i] = acceleration_reference


@kernel
def control_torque(
    acceleration_option, parent, rotation, offset, axis, pi_hat, sigma, damping, limit, a_measured, base_signals,
    joint_signals, u, work,
):  # fmt: skip
    """u (3+n,) = Y7 pi_hat + K_D sigma [N m], equation (38), clipped to +-``limit``; fills base_signals[3] with a_r.

    ``damping``: the diagonal of K_D (3+n,). Work: 18(n+1) + 6 + n. Returns the number of clipped torques.
    """
    n = parent.shape[0]
    motion = work[0 : 12 * (n + 1)].reshape((n + 1, 12))
    load = work[12 * (n + 1) : 18 * (n + 1)].reshape((n + 1, 6))
    wrench = work[18 * (n + 1) : 18 * (n + 1) + 6 + n]
    a_r = base_signals[3]
    if acceleration_option == MEASURED:
        for k in range(3):
            a_r[k] = a_measured[k]
    else:
        mass = 0.0
        for b in range(n + 1):
            mass += pi_hat[10 * b + 9]
        for k in range(3):
            a_r[k] = 0.0
        inverse_dynamics(
            parent, rotation, offset, axis, pi_hat, base_signals[0], base_signals[1], base_signals[2], a_r,
            joint_signals[0], joint_signals[1], joint_signals[2], wrench, motion, load,
        )  # fmt: skip
        for k in range(3):
            a_r[k] = -wrench[k] / mass
    inverse_dynamics(
        parent, rotation, offset, axis, pi_hat, base_signals[0], base_signals[1], base_signals[2], a_r,
        joint_signals[0], joint_signals[1], joint_signals[2], wrench, motion, load,
    )  # fmt: skip
    clipped = 0
    for k in range(3 + n):
        value = wrench[3 + k] + damping[k] * sigma[k]
        if value > limit[k]:
            value = limit[k]
            clipped += 1
        elif value < -limit[k]:
            value = -limit[k]
            clipped += 1
        u[k] = value
    return clipped


@kernel
def adaptive_control(
    form, acceleration_option, parent, rotation, offset, axis, pi_hat, q, w, theta, thd, q_d, w_d, wdot_d, theta_d,
    thd_d, thdd_d, a_measured, gain, damping, limit, u, sigma, base_signals, joint_signals, work,
):  # fmt: skip
    """The whole law: measured and desired motion to torques ``u`` (3+n,) [N m]. Returns the number of clipped torques.

    ``q``, ``q_d``: present and desired attitude, scalar first; ``w``, ``w_d``, ``wdot_d`` in present and desired body
    axes; ``rotation`` from `joint_rotations` at ``theta``; ``a_measured`` (3,) is read with option MEASURED only.
    ``base_signals`` (4, 3) and ``joint_signals`` (3, n) are what `regressor` needs for the Lyapunov law's Y.
    """
    n = parent.shape[0]
    reference_motion(
        form, q, w, theta, thd, q_d, w_d, wdot_d, theta_d, thd_d, thdd_d, gain, sigma, base_signals, joint_signals,
        work[18 * (n + 1) + 6 + n :],
    )  # fmt: skip
    return control_torque(
        acceleration_option, parent, rotation, offset, axis, pi_hat, sigma, damping, limit, a_measured, base_signals,
        joint_signals, u, work,
    )  # fmt: skip
