"""Statements of the Cubli paper's model and geometry that are no metric of a run: printed equations, recomputed.

Source: Aerospace 2022, 9(11), 728, sections 2 and 3.2. Each function returns (whether the paper's statement holds, what
was found), or several of them by label. Its arguments are the printed case; others are the changes of the table's rows.
The law and its proof are in `papers.appc.law_checks`, Bennu's gravity in `papers.appc.gravity_checks`.
"""

import math

import numpy as np

from papers.appc.printed_law import ANGLES, GRAVITY, INERTIA, LENGTH, attitude, kinematics, moment

EDGE_ARM, CORNER_ARM = math.sqrt(0.5), math.sqrt(0.75)  # [1/l] from an edge, from a corner to the centre
STEP = 1e-6  # [rad] of central differences
UP = np.full(3, 1.0 / math.sqrt(3.0))


def plane_rotations(angles) -> np.ndarray:
    """R_3(psi) R_2(theta) R_1(phi): inertial to body coordinates (3, 3) of the Cardan sequence 1-2-3."""
    (s1, s2, s3), (c1, c2, c3) = np.sin(angles), np.cos(angles)
    return (np.array([[c3, s3, 0], [-s3, c3, 0], [0, 0, 1]]) @ np.array([[c2, 0, -s2], [0, 1, 0], [s2, 0, c2]])
            @ np.array([[1, 0, 0], [0, c1, s1], [0, -s1, c1]]))


def attitude_matrix(entry_12=1.0):
    """Eq. (1) against three plane rotations. entry_12: factor of the first row's second entry."""
    printed = attitude(ANGLES)
    printed[0, 1] *= entry_12
    error = np.abs(printed - plane_rotations(ANGLES)).max()
    return error < 1e-12, f"largest difference from three plane rotations: {error:.1e}"


def cross_matrix(v) -> np.ndarray:
    """[v] (3, 3): [v] w = v x w."""
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def kinematic_matrix(entry_12=1.0):
    """Eq. (2) against dA/dt = -[omega] A of three plane rotations. entry_12: factor of that entry of G_a."""
    omega, g = np.array([0.1, -0.2, 0.3]), kinematics(ANGLES)  # [rad/s]
    g[0, 1] *= entry_12
    change = plane_rotations(ANGLES + STEP * (g @ omega)) - plane_rotations(ANGLES - STEP * (g @ omega))
    error = np.abs(change / (2.0 * STEP) + cross_matrix(omega) @ plane_rotations(ANGLES)).max()
    return error < 1e-9, f"largest difference {error:.1e} 1/s"


def turned(angle) -> np.ndarray:
    """Inertial to body coordinates (3, 3) of a body turned by angle [rad] about its diagonal, [1, 1, 1] / sqrt(3)."""
    cross = cross_matrix(UP)
    return np.eye(3) - math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross


def always_invertible(turn=2.0 * math.pi / 3.0):
    """Remark 1 for a rover that balances, turned by turn [rad] about the vertical: det(G_a) = 1 / cos(theta)."""
    matrix = turned(turn)
    balanced = np.abs(matrix @ UP - UP).max() < 1e-12
    sine = matrix[2, 0]  # of theta, eq. (1)
    return balanced and 1.0 - abs(sine) > 1e-6, f"sin(theta) = {sine:.6f} for a rover that stands upright"


def invertible_nearby(theta=1.5):
    """G_a at theta [rad]: its condition number."""
    with np.errstate(all="ignore"):
        condition = np.linalg.cond(kinematics((0.3, theta, -0.4)))
    return condition < 100.0, f"condition number of G_a at theta = {theta:.4g} rad: {condition:.3g}"


def lying(faces=(0, 1, 2)):
    """Remark 1: on the ground, on a face at the pivot (number of its axis), in every heading, theta is in (0, pi / 2)."""
    sines = []
    for face in faces:
        axis = np.cross(UP, np.eye(3)[face])
        cross = cross_matrix(axis)
        upright = np.eye(3) + cross + cross @ cross / (1.0 + UP[face])  # takes UP to that body axis
        sines += [(upright @ turned(heading))[2, 0] for heading in np.radians(range(360))]
    low, high = np.degrees(np.arcsin([min(sines), max(sines)]))
    return {"theta is not +-pi/2": (bool(max(map(abs, sines)) < 0.99), f"{low:.1f} to {high:.1f} degrees"),
            "0 < theta < pi/2": (bool(low > 0.0 and high < 90.0), f"{low:.1f} to {high:.1f} degrees")}


def inverted_pendulum(arm=-0.5 * LENGTH):
    """Eq. (4) with r = arm [1, 1, 1] [m] falls over: eigenvalues of eq. (2), (4), (5), linearised, g = 0.002 m/s^2."""
    moments = [(moment(small, arm) - moment(-small, arm)) / (2.0 * STEP) for small in STEP * np.eye(3)]
    nothing, stiffness = np.zeros((3, 3)), np.array(moments).T / INERTIA
    values = np.linalg.eigvals(np.block([[nothing, np.eye(3)], [stiffness, nothing]]))
    largest = max(values, key=lambda value: (round(value.real, 6), value.imag))
    unstable = largest.real > 1e-6
    return unstable, (f"eigenvalues +-{largest.real:.4f} 1/s: it falls" if unstable else
                      f"eigenvalues +-{abs(largest.imag):.4f}i 1/s: it swings, and hangs")


def inertia(arm=CORNER_ARM):
    """I0 = m l^2 / 6 about a point at arm [l] from the centre (Steiner): across the line to the centre."""
    ratio = 1.0 + 6.0 * arm * arm
    return abs(ratio - 1.0) < 0.01, f"a homogeneous cube has {ratio:.2f} times m l^2 / 6 across the line to its centre"


def products_of_inertia(arm=CORNER_ARM):
    """I_xy about a point at arm [l] along the diagonal from the centre, over the moment I_xx there."""
    square = arm * arm / 3.0  # [l^2] of each coordinate
    share = -square / (1.0 / 6.0 + 2.0 * square)
    return abs(share) < 0.01, f"I_xy is {share:.3f} of I_xx"


def angle_names(captions=("roll", "yaw", "pitch")):
    """phi, theta, psi are called the same in section 2.1 and in captions."""
    section = ("pitch", "yaw", "roll")
    return section == tuple(captions), f"{', '.join(section)} in section 2.1, {', '.join(captions)} in captions"


def edge_length(environment=0.15):
    """The edge [m] of section 3.2 against that of section 5."""
    return abs(environment - LENGTH) < 1e-9, f"{environment:g} m in section 3.2, {LENGTH:g} m in section 5"


# -- section 3.2: leaving the ground -----------------------------------------------------------------------------------
def force_projection(normal_sign=-1.0):
    """Eq. (6) against the force along the line from the centre to the ground's point, for all leans and slopes.

    normal_sign: that of the term F_n cos(beta).
    """
    errors = []
    for lean, slope in ((0.4, 0.1), (-0.3, 0.25), (0.2, -0.3)):  # [rad] from the vertical, of the ground
        normal, along = np.array([math.sin(slope), math.cos(slope)]), np.array([math.cos(slope), -math.sin(slope)])
        inward = -np.array([math.sin(lean), math.cos(lean)])
        weight, support, friction = 1.0, 0.6, 0.3
        exact = inward @ (weight * np.array([0.0, -1.0]) + support * normal - friction * along)
        beta = lean - slope
        errors.append(abs(weight * math.cos(lean) + friction * math.sin(beta) + normal_sign * support * math.cos(beta)
                          - exact))
    return max(errors) < 1e-12, f"largest difference {max(errors):.1e} of the weight"


def planar_normal_force(rate, rate_dot=0.0, lean=0.0, slope=0.0, arm=EDGE_ARM, gravity=GRAVITY):
    """Force of the ground on a cube about its edge, over m g: (normal, tangential), from Newton's law alone.

    rate [rad/s], rate_dot [rad/s^2]; lean [rad] of the line to the centre from the vertical, slope [rad] of the ground,
    both to the same side; arm [l].
    """
    out, across = np.array([math.sin(lean), math.cos(lean)]), np.array([math.cos(lean), -math.sin(lean)])
    acceleration = arm * LENGTH * (rate_dot * across - rate * rate * out)
    force = acceleration + np.array([0.0, gravity])
    return (force @ np.array([math.sin(slope), math.cos(slope)]) / gravity,
            force @ np.array([math.cos(slope), -math.sin(slope)]) / gravity)


def planar_limit(radical=math.sqrt(2.0)):
    """Eq. (9), sqrt(radical g / l), is where the upright cube loses the ground."""
    rate = math.sqrt(radical * GRAVITY / LENGTH)
    normal, _ = planar_normal_force(rate)
    return abs(normal) < 1e-12, f"at {rate:.7f} rad/s the normal force is {normal:.1e} m g"


def corner_limit(arm=CORNER_ARM):
    """At the rate of eq. (9) the cube on a point at arm [l] from its centre still is on the ground."""
    normal, _ = planar_normal_force(math.sqrt(math.sqrt(2.0) * GRAVITY / LENGTH), arm=arm)
    share = math.sqrt(EDGE_ARM / arm)
    return normal > -1e-12, f"the normal force there is {normal:.3f} m g; the limit is {share:.4f} of eq. (9)"


def slope_in_limit(slope=0.3):
    """cos(alpha) of eq. (9), alpha the ground's slope [rad]: where the limit is the rate of no normal force."""
    limit = math.sqrt(math.sqrt(2.0) * GRAVITY * math.cos(slope) / LENGTH)
    found = {}
    for label, lean in (("centre of mass above the pivot (equilibrium)", 0.0), ("along the ground's normal", slope)):
        normal, _ = planar_normal_force(limit, lean=lean, slope=slope)
        found[label] = abs(normal) < 1e-9, f"{normal:.4f} m g left at eq. (9), slope {math.degrees(slope):.0f} degrees"
    return found


def critical_state(lean=0.4493):
    """The tangential force where the normal force vanishes, at lean [rad] (of the paper's start) and constant rate."""
    rate = math.sqrt(GRAVITY / (EDGE_ARM * LENGTH * math.cos(lean)))
    normal, tangential = planar_normal_force(rate, lean=lean)
    return abs(tangential) < 0.01, f"tangential force {tangential:.3f} m g at a normal force of {abs(normal):.1e} m g"


def equal_disturbance_is_seen(phases=(0.0, 0.0, 0.0)):
    """A disturbance of equal amplitudes, at phases [rad], works against gravity: its part across the body diagonal."""
    d = np.array([np.sin(np.linspace(0.0, 2.0 * math.pi, 73) + phase) for phase in phases]).T
    across = d - d.mean(axis=1, keepdims=True)
    share = np.linalg.norm(across, axis=1).max() / np.linalg.norm(d, axis=1).max()
    return share > 0.1, f"part of d across the body diagonal, where gravity has its moment: {share:.1e}"


