"""One scenario with a fault of every type, at every kind of place, in every kind of window; with monitors that act."""

from tests.faults.chain import fault

IMU = "gauge.imu.angular_velocity"

NUMBERS = [
    fault("bias", f"{IMU}[0]", "bias", value=0.1, ramp_s=0.2, from_s=0.1, until_s=0.9),
    fault("drift", "gauge.imu.linear_acceleration[1]", "drift", value=0.3, every_s=0.3, for_s=0.1),
    fault("scale", IMU, "scale", value=1.1, ramp_s=0.05, from_s=0.15),
    fault("stuck", "gauge.imu.linear_acceleration[2]", "held", from_s=0.31, until_s=0.47),
    fault("stuck", "gauge.imu.orientation_covariance[4]", "stuck", value=-1.0, every_s=0.1, for_s=0.03),
    fault("spike", f"{IMU}[1]", "spike", value=2.0, at_s=0.123),
    fault("spike", "gauge.range.range", "spikes", value=2.0, every_s=0.15),
    fault("noise", IMU, "noise", value=0.01, from_s=0.05),
    fault("noise", "gauge.range.range", "noise32", value=0.1),
    fault("quantise", "gauge.imu.linear_acceleration[0]", "quantise", value=0.01),
    fault("saturate", "gauge.range.range", "saturate", value=10.2, from_s=0.7),
    fault("off", "gauge.imu.orientation", "off", probability=0.5),
    fault("bit_flip", "gauge.range.radiation_type", "flip8", bit=3, probability=0.4),
    fault("bit_flip", f"{IMU}[2]", "flip", bit=50, when="abs(imu.angular_velocity[2]) > 0.1"),
    fault("noise", "follower <- imu.angular_velocity[0]", "reader_noise", value=0.01, unit="cable"),
    fault("stuck", "follower <- aid.push", "pushed", value=3.5, from_s=0.2, for_s=0.2),
    fault("saturate", "bystander <- imu.angular_velocity", "blinkers", value=0.2),
    fault("bit_flip", "bystander <- imu.angular_velocity[1]", "reader_flip", bit=40, every_s=0.07),
    fault("spike", "follower.state.total", "jump", value=0.5, every_s=0.2),
    fault("bit_flip", "follower.state.count", "upset", bit=4, at_s=0.5),
    fault("stuck", "follower.state.held[1]", "jammed", from_s=0.6, until_s=0.75),
    fault("off", "follower.state.held[2]", "emptied", when="follower.echo.held[2] > 0.5"),
    fault("saturate", "world.state.angle[2]", "stop", value=0.08),
    fault("drift", "gauge.parameters.gain", "ageing", value=0.4, when="follower.echo.total > 7.5 or t > 0.8", for_s=0.2),
    fault("bias", "gauge.parameters.offset[1]", "offset", value=0.05, ramp_s=0.1, from_s=0.45),
    fault("scale", "world.parameters.rate[0]", "wind", value=2.0, when="gauge.imu.linear_acceleration[0] > 0.1 and t < 0.6"),
    fault("stuck", "world.parameters.rate[1]", "lull", value=0.0, when="age(gauge.range) > 0.049"),
]
MESSAGES = [
    fault("drop", "gauge.range", "drop", probability=0.3),
    fault("drop", "gauge.imu", "each7th", every=7, from_s=0.1),
    fault("duplicate", "gauge.imu", "twice", every=3),
    fault("duplicate", "follower.echo", "twice_too", probability=0.5),
    fault("delay", "gauge.imu", "late", ticks=2, from_s=0.4, until_s=0.5),
    fault("freeze", "gauge.imu", "frozen", from_s=0.6, until_s=0.65),
    fault("stale", "gauge.imu", "stale", from_s=0.7, until_s=0.75),
    fault("drop", "follower <- range", "lost", every=2),
    fault("delay", "bystander <- imu", "slow", ticks=3, until_s=0.3),
    fault("freeze", "bystander <- imu", "cold", from_s=0.4, for_s=0.1),
    fault("stale", "bystander <- imu", "old", when="bystander.seen.rate[0] > 0.15", for_s=0.05),
]
COMPONENTS = [
    fault("hang", "bystander", "hang", every_s=0.3, for_s=0.05, from_s=0.2),
    fault("restart", "follower", "restart", from_s=0.55, for_s=0.06),
    fault("crash", "manager", "crash", from_s=0.85),
    fault("hang", "gauge", "blackout", when="gauge.imu.angular_velocity[1] < -0.12", for_s=0.04),
]
MONITORS = {
    "rate_hz": 50,
    "watchpoints": [
        {"id": "fast", "when": "abs(gauge.imu.angular_velocity[0]) > 0.1 or follower.echo.total / 2 > 4"},
        {"id": "silent", "stale": "gauge.range", "after_s": 0.06}],
    "actionpoints": [
        {"id": "slow_down", "when": "fast", "in_a_row": 3, "act": "each", "set": {"follower.initial": 3.0}, "mode": {"manager": "hold"}},
        {"id": "blind", "when": "silent and not fast or silent", "level": "warn", "text": "no distance", "blames": ["gauge"],
         "mode": {"manager": "rest"}, "set": {"gauge.offset[2]": 0.01}}],
}
FAULTS = [*NUMBERS, *MESSAGES, *COMPONENTS]
