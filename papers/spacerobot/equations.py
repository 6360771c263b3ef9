"""Equations (1), (2), (7)-(22) as printed, against the dynamics in inertial axes: one function a row of the claims table.

Source: Aerospace 2023, 10(8), 679, section 2. Each draws random robots and motions, evaluates the printed formula and
compares it with `papers.spacerobot.inertial_frame`. ``factor`` multiplies one term of a formula that holds; ``corrected``
puts in place of a misprint what should stand there. Each returns (holds, what was found), or several by label.
"""

import numpy as np

from papers.spacerobot.inertial_frame import (
    Z,
    angular_velocity,
    bodies,
    cross_matrix,
    floating,
    joint_wrenches,
    momenta,
    random_arm,
    random_motion,
    torques,
    total,
    turn,
)

EXACT = 1e-9  # [1] largest relative difference that rounding explains
STATES = 10
JOINTS = 4


def states(count=STATES):
    """Random robots, each in a random motion whose centre of mass rests."""
    draw = np.random.default_rng(679)
    for _ in range(count):
        arm = random_arm(draw, JOINTS)
        yield arm, floating(arm, random_motion(draw, JOINTS))


def worst(pairs) -> float:
    """Largest difference of pairs (printed, true), relative to the largest true entry of its pair."""
    return max(float(np.abs(np.subtract(a, b)).max() / np.abs(b).max()) for a, b in pairs)


def agree(pairs, note="") -> tuple[bool, str]:
    """(holds, text) of pairs (printed, true)."""
    pairs = list(pairs)
    error = worst(pairs)
    return error < EXACT, f"largest relative difference {error:.1e} in {len(pairs)} comparisons{note}"


def in_base(motion, vector):
    """A vector of inertial axes in base axes."""
    return motion.rotation.T @ vector


def centroid(corrected: bool = False):
    """(1): the position of the system's centroid. The vectors are turned into base axes, which (1) does not say."""
    def position(arm, motion, upto):
        placed = bodies(arm, motion)
        links = [in_base(motion, after.value - before.value) for (_, before), (_, after) in zip(placed, placed[1:])]
        found = arm.mass[0] * arm.center[0]
        for i in range(1, JOINTS + 1):
            own = in_base(motion, placed[i][0].value @ arm.center[i])
            found = found + arm.mass[i] * (np.sum(links[:upto(i)], axis=0) + own)
        return found / arm.mass.sum()

    def true(arm, motion):
        sums = [np.concatenate([pi[9] * origin.value + rotation.value @ pi[6:9], [pi[9]]])
                for pi, (rotation, origin) in zip(arm.pi, bodies(arm, motion))]
        found = np.sum(sums, axis=0)
        return in_base(motion, found[:3] / found[3])
    return agree((position(arm, motion, (lambda i: i) if corrected else (lambda i: JOINTS)), true(arm, motion))
                 for arm, motion in states())


def system_inertia(corrected: bool = False, row_vectors: bool = False):
    """(2): the inertia of the whole system about its centroid, base axes, as it turns with locked joints."""
    def printed(arm, motion):
        placed = bodies(arm, motion)
        centers = [origin.value + rotation.value @ c for (rotation, origin), c in zip(placed, arm.center)]
        middle = arm.mass @ centers / arm.mass.sum()
        found = np.zeros((3, 3))
        for mass, inertia, center, (rotation, _) in zip(arm.mass, arm.inertia, centers, placed):
            r = in_base(motion, center - middle)
            turned = motion.rotation.T @ rotation.value
            steiner = r @ r * np.eye(3) - np.outer(r, r)
            if corrected or row_vectors:
                found += (turned @ inertia @ turned.T if corrected else inertia) + mass * steiner
            else:
                found += inertia - mass * steiner
        return found

    def true(arm, motion):
        columns = []
        for direction in np.eye(3):
            still = motion._replace(w=direction, al=np.zeros(3), thd=np.zeros(JOINTS), thdd=np.zeros(JOINTS))
            columns.append(in_base(motion, total(arm, floating(arm, still)).angular))
        return np.array(columns).T
    return agree((printed(arm, motion), true(arm, motion)) for arm, motion in states())


def base_velocity(corrected: bool = False):
    """(7): the base's velocity is the rate of r_0 of (1), with the centroid at rest (corrected: with a minus sign)."""
    sign = -1.0 if corrected else 1.0

    def rate(arm, motion):
        placed = bodies(arm, motion._replace(v=np.zeros(3), a=np.zeros(3)))
        return arm.mass @ [origin.rate + rotation.rate @ c for (rotation, origin), c in zip(placed, arm.center)] / (
            arm.mass.sum())
    return agree((in_base(motion, sign * rate(arm, motion)), in_base(motion, motion.v)) for arm, motion in states())


def in_body(rotation, vector):
    """A vector of inertial axes in the axes of a body."""
    return rotation.value.T @ vector


def velocities(factor: float = 1.0):
    """(8), (9): velocities of the bodies, outward. factor: of omega x P."""
    pairs = []
    for arm, motion in states():
        w, v = motion.w, in_base(motion, motion.v)
        for i, (rotation, origin) in enumerate(bodies(arm, motion)[1:]):
            turned = (turn(0, arm.alpha[i]) @ turn(2, motion.theta[i])).T
            v = turned @ (v + factor * np.cross(w, arm.offset[i]))
            w = turned @ w + motion.thd[i] * Z
            pairs += [(w, in_body(rotation, angular_velocity(rotation)[0])), (v, in_body(rotation, origin.rate))]
    return agree(pairs)


def jacobian(arm, motion, factor=1.0):
    """J_b and J_m of (11), (12) for the end at the origin of the last body, inertial axes."""
    placed = bodies(arm, motion)
    end = placed[-1][1].value
    lever = factor * cross_matrix(end - placed[0][1].value)
    base = np.block([[np.eye(3), -lever], [np.zeros((3, 3)), np.eye(3)]])
    axes = [rotation.value @ Z for rotation, _ in placed[1:]]
    arms = [np.concatenate([np.cross(axis, end - origin.value), axis]) for axis, (_, origin) in zip(axes, placed[1:])]
    return base, np.array(arms).T


def _end(arm, motion, factor, rates):
    base, joints = jacobian(arm, motion, factor)
    placed = bodies(arm, motion)
    first, last = angular_velocity(placed[0][0])[0], angular_velocity(placed[-1][0])[0]
    return (base @ np.concatenate([motion.v, first]) + joints @ rates, np.concatenate([placed[-1][1].rate, last]))


def end_effector(corrected: bool = False):
    """(10): velocity of the end, with J_m Theta as printed (corrected: the joint rates)."""
    return agree(_end(arm, motion, 1.0, motion.thd if corrected else motion.theta) for arm, motion in states())


def jacobians(factor: float = 1.0):
    """(11), (12): the Jacobians, with rates. factor: of (P_e - P_0)^x."""
    return agree(_end(arm, motion, factor, motion.thd) for arm, motion in states())


def accelerations(factor: float = 1.0):
    """(13)-(15): accelerations outward, v_dot the inertial acceleration in body axes. factor: of omega x (omega x P)."""
    pairs = []
    for arm, motion in states():
        w, al, a = motion.w, motion.al, in_base(motion, motion.a)
        for i, (rotation, origin) in enumerate(bodies(arm, motion)[1:]):
            turned, offset = (turn(0, arm.alpha[i]) @ turn(2, motion.theta[i])).T, arm.offset[i]
            a = turned @ (np.cross(al, offset) + factor * np.cross(w, np.cross(w, offset)) + a)
            al = turned @ al + np.cross(turned @ w, motion.thd[i] * Z) + motion.thdd[i] * Z
            w = turned @ w + motion.thd[i] * Z
            c = arm.center[i + 1]
            center = np.cross(al, c) + np.cross(w, np.cross(w, c)) + a
            pairs += [(al, in_body(rotation, angular_velocity(rotation)[1])), (a, in_body(rotation, origin.second)),
                      (center, in_body(rotation, origin.second + rotation.second @ c))]
    return agree(pairs)


def forces(factor: float = 1.0):
    """(16)-(20): force and moment of every body and joint, inward. factor: of omega x (I omega)."""
    pairs = []
    for arm, motion in states():
        placed = bodies(arm, motion)
        f, n = np.zeros(3), np.zeros(3)
        true_f, true_n = joint_wrenches(arm.pi, arm, motion)
        tau = torques(arm.pi, arm, motion)[6:]
        for i in range(JOINTS, -1, -1):
            rotation, origin = placed[i]
            w, al = (in_body(rotation, one) for one in angular_velocity(rotation))
            c, inertia = arm.center[i], arm.inertia[i]
            own_f = arm.mass[i] * in_body(rotation, origin.second + rotation.second @ c)
            own_n = inertia @ al + factor * np.cross(w, inertia @ w) + np.cross(c, own_f)
            if i < JOINTS:
                joint = turn(0, arm.alpha[i]) @ turn(2, motion.theta[i])
                n = joint @ n + np.cross(arm.offset[i], joint @ f)
                f = joint @ f
            f, n = f + own_f, n + own_n
            pairs += [(f, true_f[i]), (n, true_n[i])] if i else [(n, true_n[i])]
            if i:
                pairs.append((n @ Z, tau[i - 1]))
    return agree(pairs)


def linear_momentum(centered: bool = False):
    """(21): P by v_0 is conserved, v_0 that of the base's origin as in (7), (10), or that of its centre of mass."""
    found = {"centre of mass": [], "origin of the frame": []}
    for arm, motion in states():
        arm = arm.centered_base() if centered else arm
        motion = floating(arm, motion)
        placed = bodies(arm, motion)
        rates = [origin.rate + rotation.rate @ c for (rotation, origin), c in zip(placed, arm.center)]
        scale = np.abs(arm.mass[:, None] * rates).max()
        rest = np.sum([m * rate for m, rate in zip(arm.mass[1:], rates[1:])], axis=0)
        for name, rate in zip(found, (rates[0], placed[0][1].rate)):
            found[name].append(np.abs(arm.mass[0] * rate + rest).max() / scale)
    return {f"v_0 of the base's {name}": (bool(max(errors) < EXACT), f"momentum {max(errors):.1e} of its largest part")
            for name, errors in found.items()}


def angular_momentum(factor: float = 1.0):
    """(22): L by spin and orbit of the bodies, against the slope of the kinetic energy. factor: of I omega."""
    def printed(arm, motion):
        found = np.zeros(3)
        for mass, c, inertia, (rotation, origin) in zip(arm.mass, arm.center, arm.inertia, bodies(arm, motion)):
            turned = rotation.value @ inertia @ rotation.value.T
            center = origin.value + rotation.value @ c
            found += (factor * turned @ angular_velocity(rotation)[0]
                      + np.cross(center, mass * (origin.rate + rotation.rate @ c)))
        return found

    def energy(arm, motion):
        """Twice the kinetic energy: the momenta's power on the bodies' own motion."""
        found = 0.0
        for pi, (rotation, origin) in zip(arm.pi, bodies(arm, motion)):
            part, w = momenta(pi, rotation, origin), angular_velocity(rotation)[0]
            found += part.linear @ (origin.rate - np.cross(w, origin.value)) + part.angular @ w
        return found

    def true(arm, motion):
        """dT/ds of the whole robot's turn with rate s about the inertial origin, which is the base's."""
        moved = [motion._replace(w=motion.w + sign * motion.rotation.T @ axis) for axis in np.eye(3) for sign in (1, -1)]
        values = [energy(arm, one) / 2.0 for one in moved]
        return np.array([(values[2 * k] - values[2 * k + 1]) / 2.0 for k in range(3)])
    return agree((printed(arm, motion), true(arm, motion)) for arm, motion in states())
