"""What fails in the joints of the space robot's truth: friction, brakes, seized gears, and backlash.

Friction acts as impulses over each step h of integration (time stepping, Moreau 1988), so that rest is rest: an impulse
P_i of joint i within +-capacity x h takes the rate at the end to zero if it can, else it is at its bound and against the
motion; viscous friction is implicit, P_i = -c h theta_dot+. Brakes and seized gears are capacities. A first step without
friction says what P is; the step is taken again with the torque P / h, so that a joint at rest does not creep; what is then
missing of P acts at the end, with the work dP.(theta_dot- + theta_dot+) / 2, exactly. All of it is inner: momenta are kept.

Backlash is a play between a drive without mass and its joint: a drive that pushes crosses the play at its no-load rate,
and passes its torque on only where the flanks touch.

``p``, ``x``: the plant's parameters and state; ``state``: the state vector of `sim_nodes.spacerobot.dynamics`.
"""

import math

from flight_math import kernel, rotate, stack_array, vec3
from flight_math.dense import cholesky, cholesky_solve, copy
from sim_nodes.spacerobot.dynamics import RobotState, robot_state, step, write_state
from spacerobot_ros.dynamics import mass_matrix, reduced_mass_matrix
from spacerobot_ros.kinematics import posed

SWEEPS = 200  # [-] of Gauss and Seidel's iteration, at most
CONVERGED = 1e-15  # [N m s]


@kernel
def friction_capacity(p, brakes, capacity):
    """Fill ``capacity`` (n,) [N m] with the dry friction of each joint, its brake (``brakes`` > 0.5) included; returns
    whether a joint has any friction at all."""
    rubs = False
    for i in range(len(capacity)):
        capacity[i] = p.joint_friction[i] + p.joint_seized[i]
        if brakes[i] > 0.5:
            capacity[i] += p.brake_torque[i]
        rubs = rubs or capacity[i] > 0.0 or p.joint_viscous[i] > 0.0
    return rubs


@kernel
def slowed(rate, mobility, dry, viscous):
    """Rate of a joint after its friction: the ``rate`` without it, less mobility x dry [N m s] down to rest, and over
    1 + mobility x viscous [N m s^2/rad]."""
    left = max(abs(rate) - mobility * dry, 0.0) / (1.0 + mobility * viscous)
    return math.copysign(left, rate)


@kernel
def responses(p, pi, joints, h, response):
    """Fill ``response`` (n, 3+n): change of base and joint rates by a unit impulse of each joint [1/(kg m^2)], linear
    momentum kept; ``h`` (6+n, 6+n) becomes the mass matrix."""
    n = len(joints)
    reduced = stack_array(3 + n, 3 + n)
    mass_matrix(posed(p, joints, stack_array(n, 3, 3)), pi, h)
    reduced_mass_matrix(h, reduced)
    cholesky(reduced, 3 + n)
    for i in range(n):
        for k in range(3 + n):
            response[i, k] = 0.0
        response[i, 3 + i] = 1.0
        cholesky_solve(reduced, 3 + n, response[i])


@kernel
def friction_impulses(p, capacity, period, response, rates, impulse):
    """Impulses (n,) [N m s] of the joints' friction over ``period`` [s], from those that have acted already; ``rates`` (n,)
    become those after the rest of them.

    Gauss and Seidel's iteration; it converges because the joints' mobility is symmetric and positive definite.
    """
    for _ in range(SWEEPS):
        largest = 0.0
        for i in range(len(rates)):
            mobility = response[i, 3 + i]
            free = rates[i] - mobility * impulse[i]
            after = slowed(free, mobility, capacity[i] * period, p.joint_viscous[i] * period)
            change = (after - free) / mobility - impulse[i]
            impulse[i] += change
            largest = max(largest, abs(change))
            for k in range(len(rates)):
                rates[k] += response[i, 3 + k] * change
            rates[i] = after
        if largest < CONVERGED:
            return


@kernel
def rub(p, pi, state, capacity, period, impulse):
    """Friction at the end of a step: ``impulse`` (n,) [N m s] has acted during it and becomes what acts in all; the rest
    changes the rates of ``state``, and adds its work."""
    n, s = len(capacity), robot_state(state)
    h, response, rates = stack_array(6 + n, 6 + n), stack_array(n, 3 + n), stack_array(n)
    before, change = stack_array(n), stack_array(6 + n)
    responses(p, pi, s.joints, h, response)
    copy(s.joint_rates, rates)
    copy(impulse, before)
    friction_impulses(p, capacity, period, response, rates, impulse)
    work = 0.0
    for i in range(n):
        rest = impulse[i] - before[i]
        work += 0.5 * rest * (s.joint_rates[i] + rates[i])
        for k in range(3 + n):
            change[3 + k] += response[i, k] * rest
    for k in range(3 + n):
        for m in range(3):
            change[m] -= h[m, 3 + k] * change[3 + k] / h[m, m]
    copy(rates, s.joint_rates)
    write_state(state, RobotState(s.position, s.velocity + rotate(s.attitude, vec3(change[0:3])), s.attitude,
                                  s.rates + vec3(change[3:6]), s.joints, s.joint_rates, s.work + work, s.impulse, s.wheels))


@kernel
def step_with_friction(p, pi, state, held, capacity, impulse):
    """`step` with friction of the joints; ``held``: wrench (6+n,), rate of the wheels' momentum [N m], period [s].

    Fills ``impulse`` (n,) [N m s] with the friction's."""
    wrench, wheel_rate, period = held
    n = len(capacity)
    trial, slowed_wrench = stack_array(len(state)), stack_array(6 + n)
    copy(state, trial)
    copy(wrench, slowed_wrench)
    step(p, pi, trial, wrench, wheel_rate, period)
    rub(p, pi, trial, capacity, period, impulse)
    for i in range(n):
        slowed_wrench[6 + i] += impulse[i] / period
    step(p, pi, state, slowed_wrench, wheel_rate, period)
    rub(p, pi, state, capacity, period, impulse)


@kernel
def meshed(p, i, torque, rate, play, period):
    """One step of the play of joint i: where the drive is in it, from -backlash/2 to backlash/2 [rad], and the torque
    [N m] that it passes on. ``rate``: of the joint [rad/s]."""
    half = 0.5 * p.backlash[i]
    run = math.copysign(p.drive_rate, torque) if torque != 0.0 else 0.0
    play = min(max(play + period * (run - rate), -half), half)
    touches = torque != 0.0 and play == math.copysign(half, torque)
    return play, torque if touches else 0.0


@kernel
def pass_on(p, x, demand, period, share, wrench):
    """Joint torques of one step into ``wrench``: what the plays let through; their means into ``x.torque``."""
    rates = robot_state(x.motion).joint_rates
    for i in range(len(p.parent)):
        if p.backlash[i] > 0.0:
            x.play[i], wrench[6 + i] = meshed(p, i, demand[3 + i], rates[i], x.play[i], period)
            x.torque[3 + i] += share * (wrench[6 + i] - demand[3 + i])


@kernel
def rubbing_step(p, x, wrench, rate, capacity, period):
    """One step of length ``period`` [s] with friction, which is kept as a mean torque too."""
    impulse = stack_array(len(capacity))
    step_with_friction(p, x.pi, x.motion, (wrench, rate, period), capacity, impulse)
    for i in range(len(capacity)):
        x.friction[i] += impulse[i] / p.period
