"""Proportional-derivative attitude control of the Cubli rover: the paper's first baseline.

Source: Aerospace 2022, 9(11), 728, section 5.4, which names the law but gives no gains. kp = 1 1/s^2 and kd = 1 1/s
make the figures' shape; other gains change the ranking (kp = 0.3, kd = 1 spends less effort than APPC).
"""

from flight_math import kernel


@kernel
def proportional_derivative(p, error, omega):
    """Angular acceleration -k_p e - k_d omega [rad/s^2]; error e [rad] of the Cardan angles, omega [rad/s]."""
    return -p.kp * error - p.kd * omega
