"""Attitude kinematics of the Cubli rover: Cardan angles 1-2-3, rotation matrix, quaternions.

Source: Aerospace 2022, 9(11), 728, equations (1) and (2).

Frames. *Body frame*: origin at the cube's centre, axes through the face centres (the wheel axes); the pivot corner is
at -l/2 [1, 1, 1]. *Balance frame*: the paper's inertial frame, the body frame at the balance point, so the cube stands
on its corner when both coincide. It is not a z-up frame: on level ground up is [1, 1, 1] / sqrt(3), gravity is
-g / sqrt(3) [1, 1, 1].

Angles (phi, theta, psi) [rad] are successive rotations about body axes 1, 2, 3; singular at theta = +-pi/2.
Quaternions are x, y, z, w (ROS order), Hamilton product, and turn body coordinates into balance-frame coordinates:
v_balance = R(q) v_body, R(q) = A(angles)^T. Outputs must not share memory with inputs unless said otherwise.
"""

import math

from flight_graph.kernel import kernel


@kernel
def cardan_rates(angles, x, y, z):
    """Eq. (2), G(angles) v: body components (x, y, z) [rad/s] -> Cardan angle rates (three floats) [rad/s]."""
    sin_psi = math.sin(angles[2])
    cos_psi = math.cos(angles[2])
    cos_theta = math.cos(angles[1])
    tan_theta = math.sin(angles[1]) / cos_theta
    along = cos_psi * x - sin_psi * y
    return along / cos_theta, sin_psi * x + cos_psi * y, z - tan_theta * along


@kernel
def body_rates(angles, phi_rate, theta_rate, psi_rate):
    """Inverse of eq. (2), G(angles)^-1 r: Cardan angle rates -> body components (three floats) [rad/s]."""
    sin_psi = math.sin(angles[2])
    cos_psi = math.cos(angles[2])
    sin_theta = math.sin(angles[1])
    cos_theta = math.cos(angles[1])
    x = cos_theta * cos_psi * phi_rate + sin_psi * theta_rate
    y = -cos_theta * sin_psi * phi_rate + cos_psi * theta_rate
    return x, y, sin_theta * phi_rate + psi_rate


@kernel
def rotation_matrix(angles, out):
    """Eq. (1), A(angles) -> out (3, 3): balance-frame coordinates to body coordinates."""
    sin_phi = math.sin(angles[0])
    cos_phi = math.cos(angles[0])
    sin_theta = math.sin(angles[1])
    cos_theta = math.cos(angles[1])
    sin_psi = math.sin(angles[2])
    cos_psi = math.cos(angles[2])
    out[0, 0] = cos_theta * cos_psi
    out[0, 1] = sin_phi * sin_theta * cos_psi + cos_phi * sin_psi
    out[0, 2] = -cos_phi * sin_theta * cos_psi + sin_phi * sin_psi
    out[1, 0] = -cos_theta * sin_psi
    out[1, 1] = -sin_phi * sin_theta * sin_psi + cos_phi * cos_psi
    out[1, 2] = cos_phi * sin_theta * sin_psi + sin_phi * cos_psi
    out[2, 0] = sin_theta
    out[2, 1] = -sin_phi * cos_theta
    out[2, 2] = cos_phi * cos_theta


@kernel
def to_body(angles, x, y, z):
    """A(angles) v: balance-frame components (x, y, z) -> body components (three floats), by three plane rotations."""
    sin_phi = math.sin(angles[0])
    cos_phi = math.cos(angles[0])
    sin_theta = math.sin(angles[1])
    cos_theta = math.cos(angles[1])
    sin_psi = math.sin(angles[2])
    cos_psi = math.cos(angles[2])
    y_1 = cos_phi * y + sin_phi * z
    z_1 = cos_phi * z - sin_phi * y
    x_2 = cos_theta * x - sin_theta * z_1
    z_2 = sin_theta * x + cos_theta * z_1
    return cos_psi * x_2 + sin_psi * y_1, cos_psi * y_1 - sin_psi * x_2, z_2


@kernel
def diagonal_torque(sign, mass, length, x, y, z):
    """s l/2 [1, 1, 1] x m (x, y, z): torque about the corner [N m] of a body-frame gravity vector [m/s^2]."""
    factor = sign * 0.5 * length * mass
    return factor * (z - y), factor * (x - z), factor * (y - x)


@kernel
def gravity_torque(angles, gravity, sign, mass, length, out):
    """Eq. (4), M_g = s l/2 [1, 1, 1] x A(angles) m gravity -> out (3,) [N m], body frame.

    gravity (3,) [m/s^2] in the balance frame; mass [kg]; length [m] of the cube's edge. sign +1 is the inverted
    pendulum; -1 is the equation as printed, r = -l/2 [1, 1, 1], for which the balance point is a stable, hanging one.
    """
    x, y, z = to_body(angles, gravity[0], gravity[1], gravity[2])
    out[0], out[1], out[2] = diagonal_torque(sign, mass, length, x, y, z)


@kernel
def quaternion_from_cardan(angles, out):
    """Cardan angles (3,) -> unit quaternion out (4,): the product q_1(phi) q_2(theta) q_3(psi)."""
    s_1 = math.sin(0.5 * angles[0])
    c_1 = math.cos(0.5 * angles[0])
    s_2 = math.sin(0.5 * angles[1])
    c_2 = math.cos(0.5 * angles[1])
    s_3 = math.sin(0.5 * angles[2])
    c_3 = math.cos(0.5 * angles[2])
    out[0] = s_1 * c_2 * c_3 + c_1 * s_2 * s_3
    out[1] = c_1 * s_2 * c_3 - s_1 * c_2 * s_3
    out[2] = c_1 * c_2 * s_3 + s_1 * s_2 * c_3
    out[3] = c_1 * c_2 * c_3 - s_1 * s_2 * s_3


@kernel
def cardan_from_quaternion(q, out):
    """Unit quaternion (4,) -> Cardan angles out (3,), theta in [-pi/2, pi/2], phi and psi in [-pi, pi]."""
    x = q[0]
    y = q[1]
    z = q[2]
    w = q[3]
    sin_theta = 2.0 * (x * z + w * y)
    if sin_theta > 1.0:
        sin_theta = 1.0
    if sin_theta < -1.0:
        sin_theta = -1.0
    out[0] = math.atan2(2.0 * (w * x - y * z), 1.0 - 2.0 * (x * x + y * y))
    out[1] = math.asin(sin_theta)
    out[2] = math.atan2(2.0 * (w * z - x * y), 1.0 - 2.0 * (y * y + z * z))


@kernel
def quaternion_multiply(a, b, out):
    """Hamilton product a b -> out (4,): first rotate by b, then by a (in the frame of a's result)."""
    out[0] = a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1]
    out[1] = a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0]
    out[2] = a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3]
    out[3] = a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]


@kernel
def quaternion_difference(a, b, out):
    """a^-1 b -> out (4,): the rotation from attitude a to attitude b, in the body frame of a."""
    out[0] = a[3] * b[0] - a[0] * b[3] - a[1] * b[2] + a[2] * b[1]
    out[1] = a[3] * b[1] + a[0] * b[2] - a[1] * b[3] - a[2] * b[0]
    out[2] = a[3] * b[2] - a[0] * b[1] + a[1] * b[0] - a[2] * b[3]
    out[3] = a[3] * b[3] + a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def quaternion_normalise(q):
    """Scale q (4,) to unit length in place; a zero quaternion becomes the identity."""
    norm = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    if norm == 0.0:
        q[3] = 1.0
    else:
        for i in range(4):
            q[i] = q[i] / norm


@kernel
def quaternion_to_body(q, x, y, z):
    """R(q)^T v: balance-frame components -> body components (three floats)."""
    t_x = 2.0 * (q[1] * z - q[2] * y)
    t_y = 2.0 * (q[2] * x - q[0] * z)
    t_z = 2.0 * (q[0] * y - q[1] * x)
    return (
        x - q[3] * t_x + q[1] * t_z - q[2] * t_y,
        y - q[3] * t_y + q[2] * t_x - q[0] * t_z,
        z - q[3] * t_z + q[0] * t_y - q[1] * t_x,
    )


@kernel
def quaternion_to_balance(q, x, y, z):
    """R(q) v: body components -> balance-frame components (three floats)."""
    t_x = 2.0 * (q[1] * z - q[2] * y)
    t_y = 2.0 * (q[2] * x - q[0] * z)
    t_z = 2.0 * (q[0] * y - q[1] * x)
    return (
        x + q[3] * t_x + q[1] * t_z - q[2] * t_y,
        y + q[3] * t_y + q[2] * t_x - q[0] * t_z,
        z + q[3] * t_z + q[0] * t_y - q[1] * t_x,
    )


@kernel
def quaternion_from_rotation_vector(x, y, z, out):
    """Rotation vector (x, y, z) [rad] -> unit quaternion out (4,)."""
    square = x * x + y * y + z * z
    angle = math.sqrt(square)
    if angle < 1e-4:  # [rad] series: the next term is below 1e-18
        factor = 0.5 - square / 48.0
    else:
        factor = math.sin(0.5 * angle) / angle
    out[0] = factor * x
    out[1] = factor * y
    out[2] = factor * z
    out[3] = math.cos(0.5 * angle)


@kernel
def rotation_vector_from_quaternion(q, out):
    """Unit quaternion (4,) -> rotation vector out (3,) [rad], the shorter way round (length at most pi)."""
    sine = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2])
    if sine < 1e-8:  # [-] half angle small: angle / sin(half angle) = 2 to 16 digits
        factor = 2.0
        if q[3] < 0.0:
            factor = -2.0
    elif q[3] < 0.0:
        factor = -2.0 * math.atan2(sine, -q[3]) / sine
    else:
        factor = 2.0 * math.atan2(sine, q[3]) / sine
    for i in range(3):
        out[i] = factor * q[i]


@kernel
def invert_3x3(matrix, out):
    """Inverse of matrix (3, 3) by cofactors -> out (3, 3); well conditioned matrices only (inertias, covariances)."""
    a = matrix[1, 1] * matrix[2, 2] - matrix[1, 2] * matrix[2, 1]
    b = matrix[1, 2] * matrix[2, 0] - matrix[1, 0] * matrix[2, 2]
    c = matrix[1, 0] * matrix[2, 1] - matrix[1, 1] * matrix[2, 0]
    scale = 1.0 / (matrix[0, 0] * a + matrix[0, 1] * b + matrix[0, 2] * c)
    out[0, 0] = scale * a
    out[1, 0] = scale * b
    out[2, 0] = scale * c
    out[0, 1] = scale * (matrix[0, 2] * matrix[2, 1] - matrix[0, 1] * matrix[2, 2])
    out[1, 1] = scale * (matrix[0, 0] * matrix[2, 2] - matrix[0, 2] * matrix[2, 0])
    out[2, 1] = scale * (matrix[0, 1] * matrix[2, 0] - matrix[0, 0] * matrix[2, 1])
    out[0, 2] = scale * (matrix[0, 1] * matrix[1, 2] - matrix[0, 2] * matrix[1, 1])
    out[1, 2] = scale * (matrix[0, 2] * matrix[1, 0] - matrix[0, 0] * matrix[1, 2])
    out[2, 2] = scale * (matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0])
