"""Reaction wheels as the control law sees them: the torque that reaches the base, and the demand that makes it so.

A wheel's mass belongs to the base, so the equation of motion Y pi = tau keeps its form with the base torque
tau_b = -h_dot - w x h, h the wheels' momentum in base axes. The gyroscopic part is 10 to 15 % of the peaks on the mini
space robot's y and z axes: it belongs in what the estimators are told and in what the wheels are asked.
"""

from flight_graph.kernel import kernel


@kernel
def effective_base_torque(momentum_rate, w, momentum, torque):
    """torque (3,) = -h_dot - w x h [N m], base axes: ``momentum_rate`` [N m], ``w`` [rad/s], ``momentum`` [N m s]."""
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        torque[k] = -momentum_rate[k] - (w[i] * momentum[j] - w[j] * momentum[i])


@kernel
def wheel_demand(torque, w, momentum, demand):
    """demand (3,) = torque + w x h [N m]: wheels that follow it (h_dot = -demand) put ``torque`` on the base."""
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        demand[k] = torque[k] + (w[i] * momentum[j] - w[j] * momentum[i])
