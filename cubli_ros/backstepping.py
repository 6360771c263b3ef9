"""Backstepping attitude control of the Cubli rover: the paper's second baseline.

Source: Aerospace 2022, 9(11), 728, section 5.4, which names the law but gives neither equation nor gains. With
e' = G omega and V = e.e / 2 + |omega - alpha|^2 / 2 the standard two steps give

    alpha = -G^-1 c1 e,   u = I (-G^T e - c2 (omega - alpha) + alpha') - M_g,   V' = -c1 |e|^2 - c2 |omega - alpha|^2.

c1 = 1 1/s, c2 = 2 1/s make the figures' shape.
"""

import math

from flight_graph.kernel import kernel
from flight_graph.vectors import matrix_vector


@kernel
def backstepping(angles, error, omega, c1, c2, inertia, gravity_torque, out, virtual_rate):
    """Torque demand out (3,) [N m] and virtual rate alpha (3,) [rad/s] of the law above.

    angles, error (3,) [rad]; omega (3,) [rad/s]; gains c1, c2 [1/s], scalars; inertia (3, 3) [kg m^2]; gravity_torque
    M_g (3,).
    """
    sin_theta = math.sin(angles[1])
    cos_theta = math.cos(angles[1])
    sin_psi = math.sin(angles[2])
    cos_psi = math.cos(angles[2])
    x = omega[0]
    y = omega[1]
    z = omega[2]
    along = cos_psi * x - sin_psi * y
    theta_rate = sin_psi * x + cos_psi * y
    psi_rate = z - sin_theta / cos_theta * along

    virtual_rate[0] = -c1 * (cos_theta * cos_psi * error[0] + sin_psi * error[1])
    virtual_rate[1] = -c1 * (-cos_theta * sin_psi * error[0] + cos_psi * error[1])
    virtual_rate[2] = -c1 * (sin_theta * error[0] + error[2])

    # alpha' = -c1 ((d/dt G^-1) e + omega), because G^-1 e' = omega
    d_00 = -sin_theta * cos_psi * theta_rate - cos_theta * sin_psi * psi_rate
    d_10 = sin_theta * sin_psi * theta_rate - cos_theta * cos_psi * psi_rate
    slope_x = -c1 * (d_00 * error[0] + cos_psi * psi_rate * error[1] + x)
    slope_y = -c1 * (d_10 * error[0] - sin_psi * psi_rate * error[1] + y)
    slope_z = -c1 * (cos_theta * theta_rate * error[0] + z)

    # G^T e
    first = (error[0] - sin_theta * error[2]) / cos_theta
    push_x = cos_psi * first + sin_psi * error[1]
    push_y = -sin_psi * first + cos_psi * error[1]

    u_x, u_y, u_z = matrix_vector(
        inertia,
        slope_x - push_x - c2 * (x - virtual_rate[0]),
        slope_y - push_y - c2 * (y - virtual_rate[1]),
        slope_z - error[2] - c2 * (z - virtual_rate[2]),
    )
    out[0] = u_x - gravity_torque[0]
    out[1] = u_y - gravity_torque[1]
    out[2] = u_z - gravity_torque[2]
