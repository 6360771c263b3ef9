"""Reaction wheels as the equation of motion sees them: the torque that reaches the base, and the demand that makes it so.

A wheel's mass belongs to the base, so the equation of motion Y pi = tau keeps its form with the base torque
tau_b = -h_dot - w x h, h the wheels' momentum in base axes. The gyroscopic part is 10 to 15 % of the peaks on the mini
space robot's y and z axes: it belongs in what the estimators are told and in what the wheels are asked.
"""

from flight_math import cross, kernel


@kernel
def effective_base_torque(momentum_rate, w, momentum):
    """-h_dot - w x h [N m], base axes: ``momentum_rate`` [N m], ``w`` [rad/s], ``momentum`` [N m s]."""
    return -momentum_rate - cross(w, momentum)


@kernel
def wheel_demand(torque, w, momentum):
    """torque + w x h [N m]: wheels that follow it (h_dot = -demand) put ``torque`` on the base."""
    return torque + cross(w, momentum)
