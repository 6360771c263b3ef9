"""What the inertial unit feels that was not commanded: residuals of force and torque.

  r_f' = (m (a - b_a) - f - r_f)/T
  h' = tau - w x J w + r_tau,  r_tau = (J w - h)/T       (momentum observer of De Luca and Mattone, ICRA 2005)

Both follow an unknown wrench as a first-order lag of time constant T; no derivative of the gyro is taken. f, tau: the
command of the interval that the sample belongs to; w = w_BI, without bias. p: `ThrusterModel`, x: `ThrusterWatch`.
"""

from flight_graph.components.records import Parameters, State, field
from flight_math import Mat3, Vec3, cross, kernel


class ThrusterModel(Parameters):
    mass: float = field(500.0, unit="kg", gt=0, doc="m")
    inertia: Mat3 = field([[120.0, 2.0, -3.0], [2.0, 100.0, 1.5], [-3.0, 1.5, 140.0]], unit="kg m^2", doc="J, in B")
    residual_time: float = field(1.0, unit="s", gt=0, doc="T of both residuals")


class ThrusterWatch(State):
    """r_f, r_tau and h."""

    force_residual: Vec3
    torque_residual: Vec3
    momentum: Vec3


@kernel
def watch_force(p, x, specific_force, command):
    """Carry r_f over a period; specific_force [m/s^2] without bias, of that period."""
    felt = p.mass * specific_force - command.wrench.force
    x.force_residual = x.force_residual + p.period / p.residual_time * (felt - x.force_residual)


@kernel
def watch_torque(p, x, w, command):
    """Carry h over a period that ends with the inertial rate w [rad/s], and take r_tau there."""
    momentum = p.inertia @ w
    x.momentum = x.momentum + p.period * (command.wrench.torque - cross(w, momentum) + x.torque_residual)
    x.torque_residual = (momentum - x.momentum) / p.residual_time


@kernel
def start_torque_watch(p, x, w):
    """Begin again at the inertial rate w, with nothing felt."""
    x.momentum, x.torque_residual = p.inertia @ w, Vec3(0.0, 0.0, 0.0)
