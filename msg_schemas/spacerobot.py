"""Topics of the space robot: a free-flying base with revolute joints.

Frames. ``inertial``: any frame that does not turn. ``space_robot_base``: origin at the base's geometric centre.
``spacerobot_B1`` and so on: the links, named after the bodies.
Quaternions on topics are x, y, z, w and turn base axes into inertial axes; angular velocities and accelerations are in
base axes. `topics` makes the table for any number of joints; `MINI` is the one of the four-joint robot.
"""

from dataclasses import dataclass

from msg_schemas.qos import Role
from msg_schemas.signal import TURNING, Quantity, Signal, named_vector

BASE = "space_robot_base"
INERTIAL = "inertial"
INERTIAL_PARAMETERS = ("Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz", "hx", "hy", "hz", "m")


@dataclass(frozen=True)
class Topics:
    """The signals of one robot. joints: number n of joints; there are n + 1 bodies and 10 (n + 1) parameters.

    frames: of the bodies, the base first.
    """

    joints: int
    frames: tuple[str, ...]
    truth: Signal
    true_parameters: Signal
    true_pose: Signal
    true_prediction: Signal
    true_frames: Signal
    imu: Signal
    star_tracker: Signal
    joint_state: Signal
    base_torque: Signal
    wheel_momentum: Signal
    odometry: Signal
    joint_estimate: Signal
    accelerations: Signal
    torque_estimate: Signal
    reference: Signal
    joint_command: Signal
    base_command: Signal
    control: Signal
    parameters: Signal
    estimator: Signal
    monitor: Signal
    health: Signal
    brakes: Signal
    safe_base_command: Signal
    safe_joint_command: Signal
    adaptation: Signal
    state_status: Signal
    actuator_status: Signal


def topics(joint_names: list[str], body_names: list[str], prefix: str = "spacerobot") -> Topics:
    """The topic table of a robot with these joints and bodies (one more than joints, the base first).

    Raises ValueError where their numbers do not fit.
    """
    n = len(joint_names)
    if len(body_names) != n + 1:
        raise ValueError(f"{n} joints carry {n + 1} bodies with the base, not {len(body_names)}")
    labels = [f"{body}.{name}" for body in body_names for name in INERTIAL_PARAMETERS]
    joints = {"header.frame_id": BASE, "name": list(joint_names)}
    measured = {**joints, "position": n, "velocity": n, "effort": n}

    def vector(topic, quantities, role, doc, names=None):
        return named_vector(f"{prefix}/{topic}", BASE, quantities, role, doc, names)

    watch = {
        "prediction_error": Quantity(None, "N m", "|tau - Y pi_hat| of the moment and joint rows, measured motion"),
        "saturated": Quantity(None, "1", "1 while a torque is at its limit"),
        "freeze": Quantity(None, "1", "1: adaptation is to rest"),
        "unread": Quantity(None, "1", "torque readings that were not finite"),
    }

    def sensor(name, size):
        return {f"{name}_admitted": Quantity(size, "1", "1: trusted"),
                f"{name}_age": Quantity(size, "s", "since the last reading that was accepted"),
                f"{name}_rejected": Quantity(size, "1", "readings that were refused, in all")}

    return Topics(
        joints=n, frames=(BASE, *(f"{prefix}_{body}" for body in body_names[1:])),
        truth=vector("truth", {
            "position": Quantity(3, "m", "base origin, inertial axes"),
            "velocity": Quantity(3, "m/s", "of the base origin, inertial axes"),
            "attitude": Quantity(4, "1", "quaternion x, y, z, w", quaternion=True),
            "rates": Quantity(3, "rad/s", "base axes"),
            "joints": Quantity(n, "rad", "angles"),
            "joint_rates": Quantity(n, "rad/s"),
            "acceleration": Quantity(3, "m/s^2", "of the base origin, base axes, torque of the last interval"),
            "angular_acceleration": Quantity(3, "rad/s^2", "likewise"),
            "joint_accelerations": Quantity(n, "rad/s^2", "likewise"),
            "base_torque": Quantity(3, "N m", "on the base, held over the last interval"),
            "joint_torque": Quantity(n, "N m", "of the drives, held over the last interval"),
            "momentum": Quantity(3, "kg m/s", "linear, inertial axes"),
            "angular_momentum": Quantity(3, "N m s", "of base and arm about the inertial origin, without wheels"),
            "impulse": Quantity(3, "N m s", "time integral of outer moments, wheels included only as what they exert"),
            "kinetic_energy": Quantity(None, "J"),
            "work": Quantity(None, "J", "done on the bodies since the start"),
            "wheel_momentum": Quantity(3, "N m s", "of the reaction wheels, base axes"),
            "limited": Quantity(None, "1", "actuators at a limit at the last interval"),
        }, Role.TRUTH, "true state of the robot"),
        true_parameters=vector("truth/parameters", {"pi": Quantity(10 * (n + 1), "SI")}, Role.TRUTH,
                               "true inertial parameters (they change when a payload is taken)", labels),
        true_pose=Signal(f"{prefix}/truth/pose", "geometry_msgs/msg/PoseStamped", Role.TRUTH,
                         {"header.frame_id": INERTIAL}, doc="pose of the base, for viewers"),
        true_prediction=vector("truth/prediction", {
            "prediction_error": Quantity(None, "N m", "|Y (pi_hat - pi)| of the moment and joint rows, true motion"),
            "parameter_error": Quantity(None, "1", "root mean square of (pi_hat - pi) / |pi|"),
        }, Role.TRUTH, "how good the estimate is, seen by who knows"),
        true_frames=vector("truth/frames", {
            "position": Quantity(3, "m", "base origin, inertial axes"),
            "attitude": Quantity(4, "1", "quaternion x, y, z, w, base to inertial axes", quaternion=True),
            "parents": Quantity(n, "1", "number of the body that carries each link; 0: the base"),
            "offsets": Quantity(3 * n, "m", "origin of each link in its parent's axes"),
            "rotations": Quantity(4 * n, "1", "quaternion x, y, z, w of each link, to its parent's axes"),
            "joints": Quantity(n, "rad", "angles"),
        }, Role.TRUTH, "where base and links stand, for viewers"),
        imu=Signal(f"{prefix}/imu", "sensor_msgs/msg/Imu", Role.SENSOR, {"header.frame_id": BASE},
                   doc="gyro and accelerometer at the base's origin; orientation is unknown (covariance -1)"),
        star_tracker=Signal(f"{prefix}/star_tracker", "geometry_msgs/msg/QuaternionStamped", Role.SENSOR,
                            {"header.frame_id": INERTIAL}, doc="measured attitude, base to inertial axes"),
        joint_state=Signal(f"{prefix}/joint_states", "sensor_msgs/msg/JointState", Role.SENSOR, measured,
                           doc="encoders, rates, and the torque held over the last interval",
                           may_be_nonfinite=("effort",), units=TURNING),
        base_torque=Signal(f"{prefix}/base_torque", "geometry_msgs/msg/WrenchStamped", Role.SENSOR,
                           {"header.frame_id": BASE}, doc="measured torque on the base over the last interval"),
        wheel_momentum=vector("wheel_momentum", {
            "momentum": Quantity(3, "N m s", "of the wheels, base axes"),
            "limited": Quantity(None, "1", "wheels at their torque or momentum limit"),
        }, Role.SENSOR, "reaction wheels; zero with an ideal actuator"),
        odometry=Signal(f"{prefix}/odometry", "nav_msgs/msg/Odometry", Role.ESTIMATE,
                        {"header.frame_id": INERTIAL, "child_frame_id": BASE},
                        doc="estimated attitude and body rates; position and velocity are not estimated (zero)"),
        joint_estimate=Signal(f"{prefix}/joint_estimate", "sensor_msgs/msg/JointState", Role.ESTIMATE, measured,
                              doc="estimated angles and rates, measured torques", may_be_nonfinite=("effort",),
                              units=TURNING),
        accelerations=vector("accelerations", {
            "translation": Quantity(3, "m/s^2", "inertial, of the base origin, base axes"),
            "angular": Quantity(3, "rad/s^2"),
            "joints": Quantity(n, "rad/s^2"),
            "known": Quantity(None, "1", "1 when they may be used"),
        }, Role.ESTIMATE, "estimated accelerations"),
        torque_estimate=Signal(f"{prefix}/base_torque_estimate", "geometry_msgs/msg/WrenchStamped", Role.ESTIMATE,
                               {"header.frame_id": BASE}, doc="torque on the base over the last interval, as believed"),
        reference=vector("reference", {
            "attitude": Quantity(4, "1", "desired quaternion x, y, z, w", quaternion=True),
            "rates": Quantity(3, "rad/s", "desired body axes"),
            "angular_acceleration": Quantity(3, "rad/s^2", "desired body axes"),
            "joints": Quantity(n, "rad"),
            "joint_rates": Quantity(n, "rad/s"),
            "joint_accelerations": Quantity(n, "rad/s^2"),
            "held": Quantity(None, "1", "joints held at a stop"),
        }, Role.COMMAND, "desired motion"),
        joint_command=Signal(f"{prefix}/joint_command", "sensor_msgs/msg/JointState", Role.COMMAND,
                             {**joints, "effort": n}, doc="torque of each joint's drive", units=TURNING),
        base_command=Signal(f"{prefix}/base_command", "geometry_msgs/msg/WrenchStamped", Role.COMMAND,
                            {"header.frame_id": BASE}, doc="torque wanted on the base"),
        control=vector("control", {
            "attitude_error": Quantity(3, "rad", "rotation vector from present to desired attitude"),
            "joint_error": Quantity(n, "rad"),
            "sigma": Quantity(3 + n, "rad/s", "eq. (33)"),
            "base_signals": Quantity(12, "rad/s, rad/s^2, m/s^2", "w, w_r, w_r_dot, a_r of Y(theta, v, v_r, v_r_dot)"),
            "joint_signals": Quantity(3 * n, "rad/s, rad/s^2", "theta_dot, theta_r_dot, theta_r_ddot"),
            "torque": Quantity(3 + n, "N m", "eq. (38), after the limit"),
            "clipped": Quantity(None, "1", "torques at their limit"),
        }, Role.TELEMETRY, "inside of the adaptive law"),
        brakes=vector("brakes", {"engaged": Quantity(n, "1", "1: the brake of the joint is engaged")}, Role.COMMAND,
                      "brakes of the joints"),
        safe_joint_command=Signal(f"{prefix}/safe_joint_command", "sensor_msgs/msg/JointState", Role.COMMAND,
                                  {**joints, "effort": n}, doc="torque of each joint's drive, as the mode allows it",
                                  units=TURNING),
        safe_base_command=Signal(f"{prefix}/safe_base_command", "geometry_msgs/msg/WrenchStamped", Role.COMMAND,
                                 {"header.frame_id": BASE}, doc="torque wanted on the base, as the mode allows it"),
        parameters=vector("parameters", {"pi": Quantity(10 * (n + 1), "SI")}, Role.ESTIMATE,
                          "estimated inertial parameters", labels),
        estimator=vector("parameter_estimator", {
            "updates": Quantity(None, "1", "measurements taken"),
            "skipped": Quantity(None, "1", "measurements that were not finite"),
            "frozen": Quantity(None, "1", "samples left out because an actuator was at its limit"),
            "repaired": Quantity(None, "1", "times the covariance had lost symmetry or positivity"),
            "reinitialised": Quantity(None, "1", "times the covariance was set back"),
            "change": Quantity(None, "1", "largest |step| of a parameter over its prior's size"),
        }, Role.TELEMETRY, "inside of a parameter estimator"),
        monitor=vector("adaptation_monitor", watch, Role.TELEMETRY, "watch over the adaptation, every sample"),
        adaptation=vector("adaptation", watch, Role.TELEMETRY, "the same, and adaptation rests outside of the mode track"),
        state_status=vector("state_status", {
            "valid": Quantity(None, "1", "1: attitude, rates and joints may be used"),
            "attitude_valid": Quantity(None, "1"),
            "rates_valid": Quantity(None, "1"),
            "joints_valid": Quantity(None, "1"),
            "healthy": Quantity(None, "1", "1: valid, and every sensor is admitted and fresh"),
            "doubted": Quantity(None, "1", "rate sensors in doubt: the rate before is held"),
            "refused": Quantity(None, "1", "readings that were refused at this sample"),
            "attitude_sigma": Quantity(None, "rad", "standard deviation of the attitude about an axis"),
            "joint_sigma": Quantity(n, "rad", "of the joint angles"),
            "innovation": Quantity(1 + n, "1", "sigmas of the last star tracker residual, and of each encoder's"),
            **sensor("gyro", None), **sensor("star_tracker", None), **sensor("encoder", n), **sensor("joint_rate", n),
        }, Role.TELEMETRY, "health of the state estimate, every sample"),
        actuator_status=vector("actuator_status", {
            "drive_error": Quantity(n, "N m", "measured less commanded torque of the joints, low-passed"),
            "base_error": Quantity(3, "N m", "likewise of the base"),
            "base_residual": Quantity(3, "N m", "moment on the base less what the motion needs, low-passed"),
            "joint_residual": Quantity(n, "N m", "torque of the joints less what the motion needs, low-passed: friction"),
            "known": Quantity(None, "1", "1 once the residuals are there"),
        }, Role.TELEMETRY, "torques that are not what was commanded, or do not move what they should"),
        health=vector("adaptation_health", {
            "level": Quantity(None, "1", "0 ok, 1 warning, 2 error"),
            "excited": Quantity(None, "1", "directions with a singular value above 1e-3 of the largest"),
            "rank": Quantity(None, "1", "directions above 1e-9 of the largest"),
            "singular_values": Quantity(10 * (n + 1), "N m", "of all regressors so far, columns scaled by the prior"),
            "smallest_eigenvalue": Quantity(n + 1, "kg m^2, kg m, kg", "of each body's estimated pseudo-inertia"),
            "impossible": Quantity(None, "1", "bodies whose estimate cannot exist"),
            "prediction_error": Quantity(None, "N m", "root mean square since the last report"),
            "saturated": Quantity(None, "1", "samples at a limit since the last report"),
            "unread": Quantity(None, "1", "torque readings that were not finite, in all"),
        }, Role.TELEMETRY, "excitation and physical consistency of the estimate"),
    )


MINI = topics([f"joint_{k}" for k in range(1, 5)], [f"B{k}" for k in range(5)])
