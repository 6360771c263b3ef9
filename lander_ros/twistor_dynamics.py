"""6-DOF relative dynamics in twistor form: the motion of B and of the motor V, as dual vectors.

Source: Zhang and Cai, Nonlinear Dynamics 100, 2427-2448 (2020), Appendix B, for the terms; the whole is ours

  dB/dt = (1/4) Gamma^T V
  M dV/dt = F_u + F_g - V_BI x M V_BI + M(V x V_DI)      for a uniformly rotating body,  V_BI = V + V_DI

with M(a + eps c) = m c + eps J a, F = force + eps torque, (a + eps c) x (p + eps l) = a x p + eps (a x l + c x p) and
V_DI^B = zeta + eps eta, zeta = R^T w_D, eta = R^T [w_D x (rho_D + r)].
"""

from flight_math import DualVector, cross, kernel, rotate_back
from lander_ros.twistor import pose_from_twistor
from lander_ros.twistor_kinematics import twistor_rate


@kernel
def dual_inertia(p, a):
    """M a = m a_dual + eps J a_real of a dual vector; p: mass, inertia."""
    return DualVector(p.mass * a.dual, p.inertia @ a.real)


@kernel
def site_motor(p, r, q):
    """V_DI^B = zeta + eps eta of the landing site's own motion, at the pose r^D, q; p: site_position, site_spin."""
    return DualVector(rotate_back(q, p.site_spin), rotate_back(q, cross(p.site_spin, p.site_position + r)))


@kernel
def twistor_state_rate(p, inertia_inverse, twistor, motor, wrench, gravity):
    """dB/dt and dV/dt under the wrench F = force [N] + eps torque [N m] in B and gravity g^D [m/s^2].

    p: mass, inertia, site_position, site_spin as in `LanderModel`; inertia_inverse = J^-1.
    """
    r, q = pose_from_twistor(twistor)
    site = site_motor(p, r, q)
    total = motor + site
    weight = rotate_back(q, p.mass * gravity)
    f = wrench - cross(total, dual_inertia(p, total)) + dual_inertia(p, cross(motor, site))
    return twistor_rate(twistor, motor), DualVector(inertia_inverse @ f.dual, (f.real + weight) / p.mass)
