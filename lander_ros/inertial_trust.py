"""How far the navigation filter believes its inertial unit: limits of what can be, a substitute for what is not believed.

  gyro           a sample may differ from the last plausible one by what the thrusters can have changed the rate since;
                 else the last one is held, and the rate is uncertain by gap_rate_sigma
  accelerometer  no specific force can exceed what all thrusters give; else the commanded force stands in, uncertain by
                 command_sigma, as long as it is not believed
  repeats        a sample that equals the last one bit for bit is none: noise does not repeat
  not trusted    the gyro's bias is set free (lost_gyro_sigma at once, lost_gyro_walk_sigma a sample): the star tracker
                 teaches it; the accelerometer is replaced by the command; both on trial again after trial_time
  gravity        the model's value may change as fast as a craft that moves slowly can make it; else the last one is held
  missing        an inertial unit that is silent for imu_timeout is not trusted
p: `InertialTests` with the filter's and the thrusters' parameters, x: `InertialTrust` with the filter's state.
"""

from flight_graph.components.records import Parameters, State, field
from flight_math import Vec3, kernel, norm
from lander_ros.navigation_filter import ATTITUDE, GYRO, POSITION, VELOCITY, add_variance


class InertialTests(Parameters):
    angular_acceleration_limit: float = field(0.12, unit="rad/s^2", gt=0, doc="largest that the thrusters can cause")
    specific_force_limit: float = field(0.2, unit="m/s^2", gt=0, doc="largest that the thrusters can cause")
    gap_rate_sigma: float = field(0.01, unit="rad/s", gt=0, doc="of a held rate")
    command_sigma: float = field(5e-3, unit="m/s^2", gt=0, doc="of the commanded force over the mass, per sample")
    lost_gyro_sigma: float = field(0.05, unit="rad/s", gt=0, doc="of the bias of a gyro that is no longer trusted")
    lost_gyro_walk_sigma: float = field(5e-4, unit="rad/s", gt=0, doc="random walk of that bias in a sample")
    lost_position_sigma: float = field(5.0, unit="m", gt=0, doc="of the place after a wrong accelerometer")
    trial_time: float = field(20.0, unit="s", gt=0, doc="without trust, before another trial")
    suspicion_time: float = field(10.0, unit="s", ge=0, doc="for which the gyro's surprise is remembered")
    torque_surprise: float = field(0.03, unit="N m", gt=0, doc="felt, not commanded: the gyro may be to blame")
    imu_timeout: float = field(0.5, unit="s", gt=0, doc="of silence, before trust is lost")
    force_residual_limit: float = field(1.0, unit="N", gt=0, doc="felt, not commanded: the accelerometer may be to blame")
    gravity_rate_limit: float = field(2e-6, unit="m/s^3", gt=0, doc="largest change of gravity in time")
    gravity_step_limit: float = field(1e-5, unit="m/s^2", gt=0, doc="and besides, at once")


class InertialTrust(State):
    """The last plausible rate [rad/s] and gravity [m/s^2], and the last samples; times since plausible samples and since
    the gyro felt what was neither commanded nor possible [s]; trust, and what is left of the time without it [s]; samples
    refused."""

    gyro_held: Vec3
    gyro_last: Vec3
    force_last: Vec3
    gyro_since: float
    force_since: float
    surprised_since: float
    gravity_held: Vec3
    gravity_since: float
    gyro_trusted: bool = True
    accelerometer_trusted: bool = True
    gyro_trial: float
    accelerometer_trial: float
    samples_refused: float


@kernel
def start_inertial(x, imu):
    """Begin with a first sample, and with trust."""
    x.gyro_held, x.gyro_since, x.force_since, x.surprised_since = imu.angular_velocity, 0.0, 0.0, 1e6
    x.gyro_trusted, x.accelerometer_trusted = True, True


@kernel
def plausible_rate(p, x, imu, is_new):
    """The rate [rad/s] to go on with: the sample's, or the last plausible one."""
    x.gyro_since += p.period
    x.surprised_since += p.period
    if is_new:
        step = norm(imu.angular_velocity - x.gyro_held)
        repeated = p.repeats_are_faults and all(imu.angular_velocity == x.gyro_last)
        x.gyro_last = imu.angular_velocity
        if repeated:
            x.samples_refused += 1.0
        elif step <= p.angular_acceleration_limit * x.gyro_since + 12.0 * p.gyro_sigma:
            x.gyro_held, x.gyro_since = imu.angular_velocity, 0.0
        else:
            x.surprised_since = 0.0
            x.samples_refused += 1.0
    return x.gyro_held


@kernel
def plausible_force(p, x, imu, is_new, command):
    """The specific force [m/s^2] to go on with, bias included: the sample's, or what was commanded."""
    x.force_since += p.period
    if is_new:
        repeated = p.repeats_are_faults and all(imu.linear_acceleration == x.force_last)
        x.force_last = imu.linear_acceleration
        if norm(imu.linear_acceleration) <= p.specific_force_limit and not repeated:
            x.force_since = 0.0
        else:
            x.samples_refused += 1.0
    if x.force_since == 0.0 and x.accelerometer_trusted:
        return imu.linear_acceleration
    return 1.0 / p.mass * command.wrench.force + x.accelerometer_bias


@kernel
def plausible_gravity(p, x, gravity):
    """The gravity [m/s^2] of the model to go on with, or the last plausible one. The first is believed."""
    x.gravity_since += p.period
    step = norm(gravity - x.gravity_held)
    if step <= p.gravity_step_limit + p.gravity_rate_limit * x.gravity_since or norm(x.gravity_held) == 0.0:
        x.gravity_held, x.gravity_since = gravity, 0.0
    return x.gravity_held


@kernel
def spread_substitutes(p, x):
    """Add to the covariance what substitutes are uncertain by, over a period."""
    if x.gyro_since > 0.0:
        add_variance(x.covariance, ATTITUDE, p.gap_rate_sigma * p.period)
    if not x.gyro_trusted:
        add_variance(x.covariance, GYRO, p.lost_gyro_walk_sigma)
    if x.force_since > 0.0 or not x.accelerometer_trusted:
        add_variance(x.covariance, VELOCITY, p.command_sigma * p.period)


@kernel
def review_trust(p, x):
    """Lose trust in a silent unit; give it another trial when its time has come."""
    if x.gyro_since > p.imu_timeout and x.gyro_trusted:
        distrust_gyro(p, x, 0.0)
    x.gyro_trial = max(x.gyro_trial - p.period, 0.0)
    if not x.gyro_trusted and x.gyro_trial == 0.0 and x.gyro_since == 0.0:
        x.gyro_trusted = True
    x.accelerometer_trial = max(x.accelerometer_trial - p.period, 0.0)
    if norm(x.force_residual) > 0.5 * p.force_residual_limit and not x.accelerometer_trusted:
        x.accelerometer_trial = p.trial_time
    if not x.accelerometer_trusted and x.accelerometer_trial == 0.0:
        x.accelerometer_trusted = True


@kernel
def distrust_gyro(p, x, error):
    """Set the gyro's bias free; error [rad]: of the attitude that it has led to."""
    x.gyro_trusted, x.gyro_trial = False, p.trial_time
    add_variance(x.covariance, ATTITUDE, error)
    add_variance(x.covariance, GYRO, p.lost_gyro_sigma)


@kernel
def distrust_accelerometer(p, x):
    """Put the command in its place, and allow for what it has done to place and velocity."""
    x.accelerometer_trusted, x.accelerometer_trial = False, p.trial_time
    add_variance(x.covariance, POSITION, p.lost_position_sigma)
    add_variance(x.covariance, VELOCITY, p.initial_velocity_sigma)
