"""Topics of the asteroid lander.

Frames. ``asteroid`` (A): fixed in the small body, origin at its centre, spinning about z. ``landing_site`` (D): fixed
in A, origin at the goal, z along the outward normal, x east. ``base_link`` (B): the spacecraft, origin at its centre
of mass; the site camera looks along -z. ``site_camera_optical``: the camera, z along its view (REP 103).
``site_inertial``: not rotating, equal to D at the epoch of the run. An
odometry is that of D, with the twist in B: linear = R^T d(r^D)/dt, angular = w_BD, the motor of Nonlinear Dynamics
100, 2427-2448 (2020). A mark on the ground lies below the goal, on the site's normal: camera and altimeter look at
it.
"""

from msg_schemas.qos import Role
from msg_schemas.signal import Quantity, Signal, named_vector

ASTEROID = "asteroid"
SITE = "landing_site"
BASE = "base_link"
INERTIAL = "site_inertial"
CAMERA = "site_camera_optical"
_ODOMETRY = {"header.frame_id": SITE, "child_frame_id": BASE}

ODOMETRY = Signal("lander/odom", "nav_msgs/msg/Odometry", Role.ESTIMATE, _ODOMETRY,
                  doc="estimated pose and motor, with covariances; pose.covariance[0] < 0: no estimate yet")
TRUTH_ODOMETRY = Signal("lander/truth/odom", "nav_msgs/msg/Odometry", Role.TRUTH, _ODOMETRY,
                        doc="true pose and motor, in the form of an estimate")
IMU = Signal("lander/imu", "sensor_msgs/msg/Imu", Role.SENSOR, {"header.frame_id": BASE},
             doc="inertial rate w_BI (not the rate relative to the site) and specific force of the last interval")
STAR_TRACKER = Signal("lander/star_tracker", "geometry_msgs/msg/QuaternionStamped", Role.SENSOR,
                      {"header.frame_id": INERTIAL}, doc="measured attitude, B to the inertial frame")
ALTIMETER = Signal("lander/altimeter", "sensor_msgs/msg/Range", Role.SENSOR, {"header.frame_id": BASE},
                   doc="distance to the mark, along the camera's line of sight to it; inf: out of reach (REP 117)",
                   may_be_nonfinite=("range",))
SITE_LOS = Signal("lander/site_los", "geometry_msgs/msg/Vector3Stamped", Role.SENSOR, {"header.frame_id": BASE},
                  doc="unit vector to the mark, in B; zero: the mark is not in the picture")
GRAVITY = Signal("lander/gravity", "geometry_msgs/msg/AccelStamped", Role.TELEMETRY, {"header.frame_id": SITE},
                 doc="gravity of the on-board model at the estimated position, in D")
COMMAND = Signal("lander/cmd_wrench", "geometry_msgs/msg/WrenchStamped", Role.COMMAND, {"header.frame_id": BASE},
                 doc="force and torque in B, after the clip")
TRUTH_POSE = Signal("lander/truth/pose", "geometry_msgs/msg/PoseStamped", Role.TRUTH, {"header.frame_id": SITE},
                    doc="true pose of B in D, for viewers")
GOAL = Signal("lander/goal", "geometry_msgs/msg/PoseStamped", Role.TRUTH, {"header.frame_id": ASTEROID},
              doc="the landing-site frame D in A")
TRUTH_FRAMES = named_vector("lander/truth/frames", SITE, {
    "position": Quantity(3, "m", "of B in D"),
    "attitude": Quantity(4, "1", "quaternion x, y, z, w, B to D", quaternion=True),
    "inertial": Quantity(4, "1", "quaternion x, y, z, w, inertial axes to D", quaternion=True),
}, Role.TRUTH, doc="where the frames that move stand, for viewers")
TRUTH = named_vector("lander/truth", BASE, {
    "site_position": Quantity(3, "m", "r, from the goal to the craft, in D"),
    "site_velocity": Quantity(3, "m/s", "d(r^D)/dt, in D"),
    "attitude": Quantity(4, "1", "quaternion x, y, z, w, B to D", quaternion=True),
    "rates": Quantity(3, "rad/s", "w_BD, in B"),
    "inertial_rates": Quantity(3, "rad/s", "w_BI, in B"),
    "specific_force": Quantity(3, "m/s^2", "of the last interval, in B"),
    "gravity": Quantity(3, "m/s^2", "in D"),
    "force": Quantity(3, "N", "delivered over the last interval, in B"),
    "torque": Quantity(3, "N m", "delivered over the last interval, in B"),
    "mass": Quantity(None, "kg"),
    "clearance": Quantity(None, "m", "d over the keep-out funnel"),
    "view_angle": Quantity(None, "rad", "between -z_B and the goal"),
    "landed": Quantity(None, "1", "1 from the contact trigger on; the state is held from then"),
}, Role.TRUTH, doc="true state of the lander")
SUMMARY = named_vector("lander/truth/summary", BASE, {
    "landed": Quantity(None, "1", "1 after the contact trigger"),
    "time": Quantity(None, "s", "flown so far, up to the contact trigger"),
    "lateral": Quantity(None, "m", "distance from the site's normal"),
    "speed": Quantity(None, "m/s"),
    "attitude_error": Quantity(None, "rad", "angle between B and D"),
    "rate": Quantity(None, "rad/s", "|w_BD|"),
    "clearance_min": Quantity(None, "m", "smallest d beyond clearance_range"),
    "clearance_min_time": Quantity(None, "s"),
    "clearance_min_all": Quantity(None, "m", "smallest d anywhere"),
    "view_max": Quantity(None, "rad", "largest view angle beyond view_range"),
    "clearance_violation": Quantity(None, "s", "time with d < 0"),
    "view_violation": Quantity(None, "s", "time out of the view cone, beyond view_range"),
    "delta_v": Quantity(None, "m/s", "integral of |f|/m"),
    "torque_impulse": Quantity(None, "N m s", "integral of |tau|"),
    "force_peak": Quantity(None, "N", "largest component"),
    "torque_peak": Quantity(None, "N m", "largest component"),
    "speed_max": Quantity(None, "m/s"),
    "saturated": Quantity(None, "s", "time with an axis at its limit"),
    "propellant": Quantity(None, "kg"),
}, Role.TRUTH, doc="what has come of the landing so far")
CONSTRAINTS = named_vector("lander/constraints", BASE, {
    "clearance": Quantity(None, "m", "d = -f1, safe above 0"),
    "view_cosine": Quantity(None, "1", "c = f2, safe above cos(view_half_angle)"),
    "view_angle": Quantity(None, "rad", "acos c"),
    "potential": Quantity(None, "J", "U"),
    "potential_terms": Quantity(4, "J", "pull, attitude, terrain, view"),
    "lyapunov": Quantity(None, "J", "L = U + kinetic terms"),
    "lyapunov_rate": Quantity(None, "W", "dL/dt under the wrench as commanded, clipped or not"),
    "lyapunov_rate_formula": Quantity(None, "W", "-k_a D_v |alpha|^2 - k_w D_w |w|^2: dL/dt where nothing is clipped"),
    "gradient": Quantity(6, "N m, N", "(1/4) Gamma dU/dB: torque-conjugate, force-conjugate"),
    "saturated_axes": Quantity(None, "1", "axes clipped now"),
    "saturated_for": Quantity(None, "s", "uninterrupted"),
    "saturated": Quantity(None, "s", "altogether"),
    "twistor_norm": Quantity(None, "1", "|b|, at most 1 on the short way"),
    "shadow": Quantity(None, "1", "1: the quaternion came with q_0 < 0, its shadow twistor is used"),
    "distance": Quantity(None, "m", "|r|"),
}, Role.TELEMETRY, doc="path constraints, potential and Lyapunov function of the landing law")
TWISTOR = named_vector("lander/twistor", BASE, {
    "twistor": Quantity(8, "1, m", "B = b + eps b'"),
    "motor": Quantity(8, "rad/s, m/s", "V = w + eps alpha"),
}, Role.TELEMETRY, doc="pose and velocity as the paper writes them")
NAVIGATION = named_vector("lander/navigation", BASE, {
    "gyro_bias": Quantity(3, "rad/s"),
    "accelerometer_bias": Quantity(3, "m/s^2"),
    "variances": Quantity(15, "m^2, m^2/s^2, rad^2, rad^2/s^2, m^2/s^4",
                          "of position (D), velocity (D), attitude (B), gyro bias, accelerometer bias"),
    "range_innovation_squared": Quantity(None, "1", "normalised, of the last measurement"),
    "los_innovation_squared": Quantity(None, "1", "normalised, two degrees of freedom"),
    "star_innovation_squared": Quantity(None, "1", "normalised, three degrees of freedom"),
    "accepted": Quantity(None, "1", "scalar measurements taken"),
    "rejected": Quantity(None, "1", "scalar measurements refused by the gate"),
}, Role.TELEMETRY, doc="inside of the navigation filter")
NAVIGATION_STATUS = named_vector("lander/navigation_status", BASE, {
    "valid": Quantity(None, "1", "1: the estimate is good enough to fly on"),
    "imu_age": Quantity(None, "s", "since the last plausible sample"),
    "star_tracker_age": Quantity(None, "s", "since the last measurement taken"),
    "altimeter_age": Quantity(None, "s", "since the last measurement taken"),
    "camera_age": Quantity(None, "s", "since the last measurement taken"),
    "star_tracker_admitted": Quantity(None, "1", "0: isolated"),
    "altimeter_admitted": Quantity(None, "1", "0: isolated"),
    "camera_admitted": Quantity(None, "1", "0: isolated"),
    "gyro_trusted": Quantity(None, "1", "0: its bias is learnt anew from the star tracker"),
    "accelerometer_trusted": Quantity(None, "1", "0: the commanded force stands in for it"),
    "gravity_trusted": Quantity(None, "1", "0: the last plausible gravity stands in for the model's"),
    "position_sigma": Quantity(None, "m", "largest of an axis"),
    "velocity_sigma": Quantity(None, "m/s", "largest of an axis"),
    "attitude_sigma": Quantity(None, "rad", "largest of an axis"),
    "rate_sigma": Quantity(None, "rad/s", "of the gyro's bias, largest of an axis"),
    "star_tracker_rejected": Quantity(None, "1", "measurements refused so far"),
    "altimeter_rejected": Quantity(None, "1", "measurements refused so far"),
    "camera_rejected": Quantity(None, "1", "measurements refused so far"),
    "imu_rejected": Quantity(None, "1", "samples refused so far, of gyro or accelerometer"),
    "isolations": Quantity(None, "1", "how often a sensor was shut out"),
    "readmissions": Quantity(None, "1", "how often one was let in again"),
    "restarts": Quantity(None, "1", "how often the filter began anew, wholly or with its place"),
    "referee": Quantity(None, "1", "log likelihood ratio of the camera: above 0 it speaks against the gyro"),
}, Role.ESTIMATE, doc="what the navigation filter thinks of its sensors and of itself")
THRUSTER_RESIDUALS = named_vector("lander/thruster_residuals", BASE, {
    "force": Quantity(3, "N", "felt less commanded, smoothed, in B"),
    "torque": Quantity(3, "N m", "felt less commanded, smoothed, in B"),
    "force_size": Quantity(None, "N", "its norm"),
    "torque_size": Quantity(None, "N m", "its norm"),
}, Role.TELEMETRY, doc="what the inertial unit feels that was not commanded")
SAFE_COMMAND = Signal("lander/safe_command", "geometry_msgs/msg/WrenchStamped", Role.COMMAND, {"header.frame_id": BASE},
                      doc="force and torque in B that the mode manager lets through or makes itself")
MANEUVER_BUDGET = named_vector("lander/maneuver_budget", BASE, {
    "spent": Quantity(None, "m/s", "integral of |f|/m as commanded so far"),
    "left": Quantity(None, "m/s", "of the budget"),
    "abort_delta_v": Quantity(None, "m/s", "what an abort needs from here: turn round, climb, stop, hold"),
    "abort_time": Quantity(None, "s", "of its climb"),
    "abort_allowed": Quantity(None, "1", "1: left covers what it needs, with the margin"),
    "hover_delta_v": Quantity(None, "m/s", "what a hover needs: stop, hold"),
    "hover_allowed": Quantity(None, "1", "1: left covers it and an abort after it"),
    "distance_to_go": Quantity(None, "m", "to the place that hover or abort hold"),
    "blind": Quantity(None, "1", "1: an abort without a valid estimate is burning or coasting"),
    "committed": Quantity(None, "1", "1: too low to leave the descent"),
    "refused": Quantity(None, "1", "requests of modes that were not allowed"),
}, Role.TELEMETRY, doc="what the safe states cost, before they are allowed")
STATUS = named_vector("lander/landing_status", BASE, {
    "level": Quantity(None, "1", "0 ok, 1 warning, 2 error, 3 stale"),
    "abort": Quantity(None, "1", "1: the constraints are no longer guaranteed, leave"),
    "reasons": Quantity(None, "1", "sum of 1 clearance, 2 view, 4 saturation, 8 energy, 16 touchdown funnel, 32 age"),
    "clearance": Quantity(None, "m", "smallest since the last status"),
    "view_angle": Quantity(None, "rad", "largest since the last status"),
    "distance": Quantity(None, "m"),
    "potential": Quantity(None, "J"),
    "lyapunov": Quantity(None, "J"),
    "lyapunov_limit": Quantity(None, "J", "L may not exceed this: its value at the start, with a margin"),
    "saturated_for": Quantity(None, "s", "uninterrupted"),
    "odometry_age": Quantity(None, "s"),
    "touchdown_ready": Quantity(None, "1", "within the touchdown funnel; 1 while still above it"),
    "twistor_norm": Quantity(None, "1"),
    "shadow": Quantity(None, "1"),
}, Role.TELEMETRY, doc="verdict of the landing monitor")
