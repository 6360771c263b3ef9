"""Proportional-derivative attitude control of the Cubli rover: the paper's first baseline.

Source: Aerospace 2022, 9(11), 728, section 5.4, which names the law but gives no gains. kp = 1 1/s^2 and kd = 1 1/s
make the figures' shape; other gains change the ranking (kp = 0.3, kd = 1 spends less effort than APPC).
"""

from flight_graph.kernel import kernel
from flight_graph.vectors import matrix_vector


@kernel
def proportional_derivative(error, omega, proportional_gain, derivative_gain, inertia, out):
    """u = I (-k_p e - k_d omega) [N m], no gravity compensation.

    error e (3,) [rad] of the Cardan angles, omega (3,) [rad/s], gains (3,) [1/s^2], [1/s], inertia (3, 3) [kg m^2].
    """
    out[0], out[1], out[2] = matrix_vector(
        inertia,
        -proportional_gain[0] * error[0] - derivative_gain[0] * omega[0],
        -proportional_gain[1] * error[1] - derivative_gain[1] * omega[1],
        -proportional_gain[2] * error[2] - derivative_gain[2] * omega[2],
    )
