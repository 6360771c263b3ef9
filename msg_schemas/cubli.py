"""Topics of the Cubli rover.

Frames. ``cubli_base``: body frame, origin at the cube's centre, axes along the wheel axes. ``cubli_balance``: the paper's
inertial frame, equal to the body frame when the rover balances on its corner (up is [1, 1, 1] / sqrt(3) there on level
ground), its origin at the corner. ``imu_link``: the inertial unit, in the body frame's place (REP 145). ``cubli_wheel_x``
and so on: the wheels, in the body's axes when they have not turned. ``site``: local east, north, up (REP 103), origin at
the corner; it is where ``map`` is.
"""

from msg_schemas import modes
from msg_schemas.qos import Role
from msg_schemas.signal import TURNING, Quantity, Signal, named_vector

BASE = "cubli_base"
BALANCE = "cubli_balance"
SITE = "site"
IMU_LINK = "imu_link"
WHEELS = ["wheel_x", "wheel_y", "wheel_z"]
WHEEL_LINKS = [f"cubli_{wheel}" for wheel in WHEELS]

TRUTH = named_vector("cubli/truth", BASE, {
    "angles": Quantity(3, "rad", "Cardan 1-2-3 angles, eq. (1)"),
    "rates": Quantity(3, "rad/s", "body rates"),
    "accelerations": Quantity(3, "rad/s^2", "angular acceleration at the end of the last interval"),
    "wheel_speed": Quantity(3, "rad/s", "relative to the body"),
    "torque": Quantity(3, "N m", "torque on the body held over the last interval"),
    "disturbance": Quantity(3, "rad/s^2", "disturbing angular acceleration now, eq. (42)"),
    "gravity": Quantity(3, "m/s^2", "in the body frame"),
}, Role.TRUTH, doc="true state of the rover")
TRUTH_FRAMES = named_vector("cubli/truth/frames", SITE, {
    "position": Quantity(3, "m", "of the cube's centre, in the site"),
    "attitude": Quantity(4, "1", "quaternion x, y, z, w, body to site", quaternion=True),
    "wheel_angle": Quantity(3, "rad", "of each wheel about its axis since the start, relative to the body"),
    "wheel_speed": Quantity(3, "rad/s", "relative to the body"),
}, Role.TRUTH, doc="where the frames that move stand, for viewers")
TRUTH_CONTACT = named_vector("cubli/truth/contact", SITE, {
    "phase": Quantity(None, "1", "0 standing on the corner, 1 flight, 2 ended (the state is frozen)"),
    "sliding": Quantity(None, "1", "1 while the corner slides"),
    "slipping": Quantity(None, "1", "1 while the force that holds the corner is outside the friction cone"),
    "normal_force": Quantity(None, "1", "smallest since the last message, in m g; as needed to hold the corner"),
    "friction_ratio": Quantity(None, "1", "largest since the last message: tangential over normal force; 1e6: none"),
    "force": Quantity(3, "N", "of the ground on the corner, now"),
    "specific_force": Quantity(3, "m/s^2", "force over mass, body frame: what an accelerometer at the centre feels"),
    "slip_time": Quantity(None, "s", "first time outside the friction cone; -1: never"),
    "lift_off_time": Quantity(None, "s", "first time without contact; -1: never"),
    "end_time": Quantity(None, "s", "when the run was decided; -1: not yet"),
    "outcome": Quantity(None, "1", "0 none yet, 1 landed after a flight, 2 fell on another corner, 3 jammed sliding"),
    "touching_corner": Quantity(None, "1", "which corner touched, bits 0 1 2: the far side along x y z; -1: none"),
    "touching_speed": Quantity(None, "m/s", "of that corner into the ground"),
    "corner": Quantity(3, "m", "position of the corner it stood on"),
    "corner_velocity": Quantity(3, "m/s", "velocity of that corner"),
    "centre": Quantity(3, "m", "position of the cube's centre"),
    "centre_velocity": Quantity(3, "m/s", "velocity of the cube's centre"),
}, Role.TRUTH, doc="contact with the ground: forces, events, and the motion of corner and centre in the site frame")
TRUTH_ATTITUDE = Signal("cubli/truth/attitude", "sensor_msgs/msg/Imu", Role.TRUTH, {"header.frame_id": BASE},
                        doc="true attitude (body to balance frame) and body rates; no acceleration (covariance -1)")
TRUTH_POSE = Signal("cubli/truth/pose", "geometry_msgs/msg/PoseStamped", Role.TRUTH, {"header.frame_id": SITE},
                    doc="pose of the cube's centre in the site frame, for viewers")
WHEEL_STATE = Signal("cubli/wheel_state", "sensor_msgs/msg/JointState", Role.SENSOR,
                     {"header.frame_id": BASE, "name": WHEELS, "velocity": 3, "effort": 3},
                     doc="wheel speeds and the torque held over the last interval", units=TURNING)
IMU = Signal("cubli/imu", "sensor_msgs/msg/Imu", Role.SENSOR, {"header.frame_id": IMU_LINK},
             doc="gyro and accelerometer at the cube's centre; orientation is unknown (covariance -1)")
STAR_TRACKER = Signal("cubli/star_tracker", "geometry_msgs/msg/QuaternionStamped", Role.SENSOR,
                      {"header.frame_id": BALANCE}, doc="measured attitude, body to balance frame")
ATTITUDE = Signal("cubli/attitude", "sensor_msgs/msg/Imu", Role.ESTIMATE, {"header.frame_id": BASE},
                  doc="estimated attitude (body to balance frame) and bias-free body rates, with covariances")
FILTER = named_vector("cubli/attitude_filter", BASE, {
    "bias": Quantity(3, "rad/s", "gyro bias"),
    "covariance": Quantity(36, "rad^2, rad^2/s, rad^2/s^2", "of (attitude error, bias), row by row"),
    "innovation": Quantity(3, "rad", "of the last star tracker measurement"),
    "innovation_squared": Quantity(None, "1", "normalised, of the last measurement"),
    "accepted": Quantity(None, "1", "measurements taken"),
    "rejected": Quantity(None, "1", "measurements refused by the gate"),
}, Role.TELEMETRY, doc="inside of the attitude filter")
COMMAND = Signal("cubli/wheel_command", "sensor_msgs/msg/JointState", Role.COMMAND,
                 {"header.frame_id": BASE, "name": WHEELS, "effort": 3}, doc="torque on the body by each wheel",
                 units=TURNING)
FUNNEL = named_vector("cubli/funnel", BASE, {
    "attitude_error": Quantity(3, "rad", "e_a, eq. (10)"),
    "attitude_bound": Quantity(3, "rad", "rho_a"),
    "attitude_xi": Quantity(3, "1", "xi_a = e_a / rho_a"),
    "rate_error": Quantity(3, "rad/s", "e_u, eq. (12)"),
    "rate_bound": Quantity(3, "rad/s", "rho_u"),
    "rate_xi": Quantity(3, "1", "xi_u = e_u / rho_u"),
    "adaptive_a": Quantity(3, "1", "v_a, eq. (15)"),
    "adaptive_u": Quantity(3, "1", "v_u, eq. (16)"),
    "torque_demand": Quantity(3, "N m", "before the limit"),
    "torque": Quantity(3, "N m", "after the limit"),
    "rearmed": Quantity(None, "1", "how often rho_a was widened"),
    "outside": Quantity(None, "1", "samples with |xi| >= 1"),
    "clipped": Quantity(None, "1", "samples with a clipped torque"),
}, Role.TELEMETRY, doc="funnels of the adaptive prescribed performance law")
TRACKING = named_vector("cubli/attitude_tracking", BASE, {
    "attitude_error": Quantity(3, "rad", "of the Cardan angles"),
    "virtual_rate": Quantity(3, "rad/s", "alpha of backstepping; zero for a law without one"),
    "torque_demand": Quantity(3, "N m", "before the limit"),
    "torque": Quantity(3, "N m", "after the limit"),
}, Role.TELEMETRY, doc="inside of a law without funnels (PD, backstepping)")
JUMP_MARGINS = named_vector("cubli/jump_margins", BASE, {
    "planar_limit": Quantity(None, "rad/s", "omega_9 of eq. (9)"),
    "corner_limit": Quantity(None, "rad/s", "the same about the corner"),
    "axis_rate": Quantity(None, "rad/s", "largest |omega_i|"),
    "rate_norm": Quantity(None, "rad/s", "|omega|"),
    "rate_across": Quantity(None, "rad/s", "across the body diagonal"),
    "axis_margin": Quantity(None, "1", "1 - (axis_rate / planar_limit)^2"),
    "norm_margin": Quantity(None, "1", "1 - (rate_norm / planar_limit)^2"),
    "across_margin": Quantity(None, "1", "1 - (rate_across / corner_limit)^2"),
    "normal_force": Quantity(None, "1", "in m g; negative: the ground would have to pull"),
    "friction_ratio": Quantity(None, "1", "tangential over normal force"),
}, Role.TELEMETRY, doc="how far the rover is from jumping")
JUMP_STATUS = named_vector("cubli/jump_status", BASE, {
    "level": Quantity(None, "1", "0 ok, 1 warning, 2 error, with hysteresis"),
    "axis_margin": Quantity(None, "1", "smallest since the last status"),
    "across_margin": Quantity(None, "1", "smallest since the last status"),
    "normal_force": Quantity(None, "1", "smallest since the last status, in m g"),
    "friction_ratio": Quantity(None, "1", "largest since the last status"),
}, Role.TELEMETRY, doc="verdict of the jump monitor")
SAFE_COMMAND = Signal("cubli/safe_command", "sensor_msgs/msg/JointState", Role.COMMAND,
                      {"header.frame_id": BASE, "name": WHEELS, "effort": 3},
                      doc="torque on the body by each wheel, from the mode manager", units=TURNING)
WHEEL_POWER = named_vector("cubli/wheel_power", BASE, {
    "on": Quantity(3, "1", "0: the drive of this wheel is without power, and the wheel turns freely"),
}, Role.COMMAND, doc="power switches of the wheels' drives")
ESTIMATOR_STATUS = named_vector("cubli/estimator_status", BASE, {
    "valid": Quantity(None, "1", "1 while attitude and rates may be used"),
    "sigma": Quantity(None, "rad", "root of the sum of the variances of the attitude error"),
    "rate_sigma": Quantity(None, "rad/s", "root of the sum of the variances of the rate error"),
    "tracker_age": Quantity(None, "s", "since the last star tracker measurement that was taken; -1: none yet"),
    "gyro_age": Quantity(None, "s", "since the last gyro sample that was taken; -1: none yet"),
    "tracker_admitted": Quantity(None, "1", "1 while star tracker measurements are taken"),
    "gyro_admitted": Quantity(None, "1", "1 while gyro samples are taken"),
    "tracker_fix": Quantity(None, "1", "1: the last star tracker message was an attitude; 0: it had no stars"),
    "tracker_rejected": Quantity(None, "1", "measurements refused so far"),
    "gyro_rejected": Quantity(None, "1", "samples refused so far"),
    "tracker_isolations": Quantity(None, "1", "how often the star tracker was isolated"),
    "gyro_isolations": Quantity(None, "1", "how often the gyro was isolated"),
    "reopened": Quantity(None, "1", "how often the gyro's bias was found to be wrong, and attitude and bias begun anew"),
    "restarts": Quantity(None, "1", "how often its own memory was found to be impossible, and begun anew"),
    "tilt_residual": Quantity(None, "rad", "between the estimate's vertical and the accelerometer's; 0 where it has none"),
}, Role.TELEMETRY, doc="what the robust attitude estimator trusts, and why")
WHEEL_STATUS = named_vector("cubli/wheel_status", BASE, {
    "torque": Quantity(3, "N m", "of each wheel on the body, from its speed, filtered"),
    "residual": Quantity(3, "N m", "that torque minus the commanded one, filtered"),
    "failed": Quantity(3, "1", "1 while a wheel does not do as it is told"),
    "age": Quantity(None, "s", "of the newest wheel speeds; -1: none yet"),
}, Role.TELEMETRY, doc="whether the wheels do as they are told")
MODE_REQUEST = modes.mode_request("cubli", BASE)
MODE = modes.mode("cubli", BASE)
SAFE_STATE = named_vector("cubli/safe_state", BASE, {
    "estimate_lost": Quantity(None, "1", "1: no valid, fresh estimate"),
    "command_lost": Quantity(None, "1", "1: no fresh nominal command"),
    "wheel_lost": Quantity(None, "1", "number of the wheel that the law does without; -1: none, -2: more than one"),
    "rate_source": Quantity(None, "1", "2: estimate, 1: gyro, 0: none"),
    "guarded": Quantity(None, "1", "ticks on which the torque was lessened to keep contact"),
    "share": Quantity(None, "1", "part of the demanded torque that keeps contact"),
    "returns": Quantity(None, "1", "how often the manager went back to balance by itself"),
    "turned": Quantity(3, "rad", "since hold was entered, rotation vector by the gyro"),
}, Role.TELEMETRY, doc="what the mode manager knows and does")
