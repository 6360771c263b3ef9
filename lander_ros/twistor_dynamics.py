"""6-DOF relative dynamics in twistor form: the motion of B and of the motor V, as dual vectors.

Source: Zhang and Cai, Nonlinear Dynamics 100, 2427-2448 (2020), Appendix B, for the terms; the whole is ours

  dB/dt = (1/4) Gamma^T V
  M dV/dt = F_u + F_g - V_BI x M V_BI + M(V x V_DI)      for a uniformly rotating body,  V_BI = V + V_DI

with M(a + eps c) = m c + eps J a, F = force + eps torque, (a + eps c) x (p + eps l) = a x p + eps (a x l + c x p) and
V_DI^B = zeta + eps eta, zeta = R^T w_D, eta = R^T [w_D x (rho_D + r)]. State (16,): B (0:8), V (8:16).
"""

from flight_graph.kernel import kernel
from flight_graph.vectors import cross, matrix_vector
from lander_ros.rotation import to_body
from lander_ros.twistor import pose_from_twistor
from lander_ros.twistor_kinematics import twistor_rate


@kernel
def dual_cross(a, b, out):
    """Cross product of dual vectors (6,) [real, dual], to (6,)."""
    out[0], out[1], out[2] = cross(a[0], a[1], a[2], b[0], b[1], b[2])
    ux, uy, uz = cross(a[0], a[1], a[2], b[3], b[4], b[5])
    vx, vy, vz = cross(a[3], a[4], a[5], b[0], b[1], b[2])
    out[3], out[4], out[5] = ux + vx, uy + vy, uz + vz


@kernel
def dual_inertia(mass, inertia, a, out):
    """M a = m a_dual + eps J a_real of a dual vector (6,), to (6,); ``out`` is not ``a``."""
    for i in range(3):
        out[i] = mass * a[3 + i]
    out[3], out[4], out[5] = matrix_vector(inertia, a[0], a[1], a[2])


@kernel
def twistor_state_rate(p, inertia_inverse, gravity, state, force, torque, work, out):
    """d(B, V)/dt, to (16,), under force [N] and torque [N m] (3,) in B and gravity g^D (3,) [m/s^2].

    p: mass, inertia, site_position, site_spin as in `LanderModel`; inertia_inverse (3, 3) = J^-1. ``work`` is (8, 8).
    """
    motor, site, total, momentum = work[0], work[1], work[2], work[3]
    first, second, third = work[4], work[5], work[6]
    r, q = work[7, 0:3], work[7, 4:8]
    pose_from_twistor(state[0:8], r, q)
    twistor_rate(state[0:8], state[8:16], out[0:8])
    for i in range(3):
        motor[i] = state[8 + i]
        motor[3 + i] = state[12 + i]
    ax, ay, az = cross(
        p.site_spin[0],
        p.site_spin[1],
        p.site_spin[2],
        p.site_position[0] + r[0],
        p.site_position[1] + r[1],
        p.site_position[2] + r[2],
    )
    site[0], site[1], site[2] = to_body(q, p.site_spin[0], p.site_spin[1], p.site_spin[2])
    site[3], site[4], site[5] = to_body(q, ax, ay, az)
    for i in range(6):
        total[i] = motor[i] + site[i]
    dual_inertia(p.mass, p.inertia, total, momentum)
    dual_cross(total, momentum, first)
    dual_cross(motor, site, second)
    dual_inertia(p.mass, p.inertia, second, third)
    gx, gy, gz = to_body(q, p.mass * gravity[0], p.mass * gravity[1], p.mass * gravity[2])
    out[12] = (force[0] + gx - first[0] + third[0]) / p.mass
    out[13] = (force[1] + gy - first[1] + third[1]) / p.mass
    out[14] = (force[2] + gz - first[2] + third[2]) / p.mass
    out[8], out[9], out[10] = matrix_vector(
        inertia_inverse,
        torque[0] - first[3] + third[3],
        torque[1] - first[4] + third[4],
        torque[2] - first[5] + third[5],
    )
    out[11] = 0.0
    out[15] = 0.0
