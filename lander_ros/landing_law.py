"""The landing law: feed-forward, the gradient of the potential, damping; with its Lyapunov function.

Source: Zhang and Cai, Nonlinear Dynamics 100, 2427-2448 (2020). Printed: Gamma (Appendix A) and the cancellation
V1' + V2' = 0 (Appendix B), which holds for any weights P, Q. The law itself is our reconstruction in that structure:

  L = U(B) + (1/2) k_a m |alpha|^2 + (1/2) k_w w^T J w
  G = (1/4) Gamma dU/dB,  G_w = torque-conjugate, G_a = force-conjugate
  f = f_ff - G_a/k_a - D_v alpha,      f_ff   = -m g^B + m zeta x eta
  tau = tau_ff - G_w/k_w - D_w w,      tau_ff = -tau_gg + zeta x J zeta
  dL/dt = -k_a D_v |alpha|^2 - k_w D_w |w|^2   (unsaturated, with the model equal to the truth)

zeta + eps eta = V_DI^B: the landing site's own motion, zeta = R^T w_D, eta = R^T [w_D x (rho_D + r)]. Coriolis and
gyroscopic terms are not cancelled: they do no work (Appendix B). Each axis of force and torque is clipped.
Units SI; D: landing-site frame, z_D outward normal; B: body. In dual form, all in B: motor V = w + eps alpha, wrench
F = f + eps tau, gradient G = G_w + eps G_a, so a wrench's real part goes with the dual part of motor and gradient.
"""

import math

from flight_graph.components.records import field
from flight_math import DualVector, dot, kernel
from lander_ros.feed_forward import LanderModel, clip_wrench, feed_forward
from lander_ros.potential import potential

OURS = "reconstruction; not printed in the paper"


class LandingLaw(LanderModel):
    """Parameters of `landing_law`."""

    pull_gain: float = field(1.0, unit="N/m", gt=0, source=OURS, doc="k_t, stiffness of the pull near the goal")
    pull_radius: float = field(35.0, unit="m", gt=0, source=OURS, doc="delta; the pull never exceeds k_t delta")
    attitude_gain: float = field(32.0, unit="N m", gt=0, source=OURS, doc="k_b, of (1/2) k_b |b|^2")
    terrain_gain: float = field(13500.0, unit="J m", ge=0, source=OURS, doc="K_1; 0: no terrain barrier")
    terrain_radius: float = field(60.0, unit="m", ge=0, source=OURS, doc="r_1, goal weighting; 0: none (it hovers)")
    view_gain: float = field(2.0, unit="N m", ge=0, source=OURS, doc="k_2; 0: no view barrier")
    view_radius: float = field(10.0, unit="m", gt=0, source=OURS, doc="r_2, goal weighting")
    view_cutoff_radius: float = field(5.0, unit="m", ge=0, source=OURS, doc="r_off, no view barrier inside")
    view_half_angle: float = field(
        math.radians(30.0), unit="rad", gt=0, lt=math.pi, source=OURS, doc="half angle of the view cone about -z_B"
    )
    funnel_alpha: float = field(27.0, unit="m^(1/gamma - 2)", gt=0, source=OURS, doc="alpha of the keep-out funnel")
    funnel_beta: float = field(1.2, unit="1", gt=0, source=OURS, doc="beta of the keep-out funnel")
    funnel_gamma: float = field(1.0 / 3.0, unit="1", gt=0, source=OURS, doc="gamma of the keep-out funnel")
    funnel_rho_0: float = field(10.0, unit="m", ge=0, source=OURS, doc="rounding of the funnel's tip")
    funnel_z_0: float = field(1.5, unit="m", ge=0, source=OURS, doc="depth of the funnel's tip below the goal")
    clearance_floor: float = field(0.05, unit="m", gt=0, source=OURS, doc="smallest d the terrain barrier is taken at")
    view_floor: float = field(0.005, unit="1", gt=0, source=OURS, doc="smallest c - c_m the view barrier is taken at")
    force_weight: float = field(1.0, unit="1", gt=0, source="Appendix B: p_eps q", doc="k_a")
    torque_weight: float = field(1.0, unit="1", gt=0, source="Appendix B: p q_eps", doc="k_w")
    linear_damping: float = field(45.0, unit="N s/m", gt=0, source=OURS, doc="D_v")
    angular_damping: float = field(60.0, unit="N m s", gt=0, source=OURS, doc="D_w")


@kernel
def landing_wrench(p, motor, gradient, forward):
    """F [N, N m] before the clip, of the gradient G of the potential and the feed-forward F_ff."""
    force = forward.real - gradient.dual / p.force_weight - p.linear_damping * motor.dual
    torque = forward.dual - gradient.real / p.torque_weight - p.angular_damping * motor.real
    return DualVector(force, torque)


@kernel
def landing_law(p, r, q, motor, gravity):
    """The wrench after the clip, and how many of its six axes are clipped.

    p: `LandingLaw` or a record with its fields; r^D [m]; q (B -> D); motor V; gravity: the model's g^D [m/s^2] at r.
    """
    _, _, _, gradient = potential(p, r, q)
    return clip_wrench(p, landing_wrench(p, motor, gradient, feed_forward(p, r, q, gravity)))


@kernel
def lyapunov(p, potential_energy, motor):
    """L [J] = U + (1/2) k_a m |alpha|^2 + (1/2) k_w w^T J w, for U [J]."""
    w, alpha = motor.real, motor.dual
    linear, angular = dot(alpha, alpha), dot(w, p.inertia @ w)
    return potential_energy + 0.5 * p.force_weight * p.mass * linear + 0.5 * p.torque_weight * angular


@kernel
def lyapunov_rate(p, motor):
    """dL/dt [W] of the unsaturated loop: -k_a D_v |alpha|^2 - k_w D_w |w|^2."""
    w, alpha = motor.real, motor.dual
    return -p.force_weight * p.linear_damping * dot(alpha, alpha) - p.torque_weight * p.angular_damping * dot(w, w)


@kernel
def lyapunov_rate_of_wrench(p, motor, gradient, excess):
    """dL/dt [W] under any wrench, clipped or held: (k_a (f - f_ff) + G_a).alpha + (k_w (tau - tau_ff) + G_w).w.

    ``excess`` is F - F_ff; exact as long as the model's gravity is the truth's.
    """
    return (dot(p.force_weight * excess.real + gradient.dual, motor.dual)
            + dot(p.torque_weight * excess.dual + gradient.real, motor.real))
