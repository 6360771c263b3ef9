"""SI units of the fields of standard messages (REP 103 and the comments of the message files).

Keys are (message type, field): the unit holds for every number below the field. A JointState's arrays are not in it:
they hold rad or m, N m or N, by joint, which `JOINT_UNITS` says of those whose names are joints.
"""

from rosbags.interfaces import Nodetype

UNITS = {
    ("builtin_interfaces/msg/Time", "sec"): "s",
    ("builtin_interfaces/msg/Time", "nanosec"): "ns",
    ("builtin_interfaces/msg/Duration", "sec"): "s",
    ("builtin_interfaces/msg/Duration", "nanosec"): "ns",
    ("geometry_msgs/msg/Pose", "position"): "m",
    ("geometry_msgs/msg/PointStamped", "point"): "m",
    ("geometry_msgs/msg/Polygon", "points"): "m",
    ("geometry_msgs/msg/Pose2D", "x"): "m",
    ("geometry_msgs/msg/Pose2D", "y"): "m",
    ("geometry_msgs/msg/Pose2D", "theta"): "rad",
    ("geometry_msgs/msg/Transform", "translation"): "m",
    ("geometry_msgs/msg/Twist", "linear"): "m/s",
    ("geometry_msgs/msg/Twist", "angular"): "rad/s",
    ("geometry_msgs/msg/Accel", "linear"): "m/s^2",
    ("geometry_msgs/msg/Accel", "angular"): "rad/s^2",
    ("geometry_msgs/msg/Wrench", "force"): "N",
    ("geometry_msgs/msg/Wrench", "torque"): "N m",
    ("geometry_msgs/msg/Inertia", "m"): "kg",
    ("geometry_msgs/msg/Inertia", "com"): "m",
    **{("geometry_msgs/msg/Inertia", f"i{axes}"): "kg m^2" for axes in ("xx", "xy", "xz", "yy", "yz", "zz")},
    ("sensor_msgs/msg/Imu", "orientation_covariance"): "rad^2",
    ("sensor_msgs/msg/Imu", "angular_velocity"): "rad/s",
    ("sensor_msgs/msg/Imu", "angular_velocity_covariance"): "rad^2/s^2",
    ("sensor_msgs/msg/Imu", "linear_acceleration"): "m/s^2",
    ("sensor_msgs/msg/Imu", "linear_acceleration_covariance"): "m^2/s^4",
    ("sensor_msgs/msg/MagneticField", "magnetic_field"): "T",
    ("sensor_msgs/msg/MagneticField", "magnetic_field_covariance"): "T^2",
    ("sensor_msgs/msg/FluidPressure", "fluid_pressure"): "Pa",
    ("sensor_msgs/msg/FluidPressure", "variance"): "Pa^2",
    ("sensor_msgs/msg/Temperature", "temperature"): "degC",
    ("sensor_msgs/msg/Temperature", "variance"): "degC^2",
    ("sensor_msgs/msg/Illuminance", "illuminance"): "lx",
    ("sensor_msgs/msg/Illuminance", "variance"): "lx^2",
    ("sensor_msgs/msg/NavSatFix", "latitude"): "deg",
    ("sensor_msgs/msg/NavSatFix", "longitude"): "deg",
    ("sensor_msgs/msg/NavSatFix", "altitude"): "m",
    ("sensor_msgs/msg/NavSatFix", "position_covariance"): "m^2",
    ("sensor_msgs/msg/Range", "field_of_view"): "rad",
    ("sensor_msgs/msg/Range", "min_range"): "m",
    ("sensor_msgs/msg/Range", "max_range"): "m",
    ("sensor_msgs/msg/Range", "range"): "m",
    ("sensor_msgs/msg/Range", "variance"): "m^2",
    ("sensor_msgs/msg/LaserScan", "angle_min"): "rad",
    ("sensor_msgs/msg/LaserScan", "angle_max"): "rad",
    ("sensor_msgs/msg/LaserScan", "angle_increment"): "rad",
    ("sensor_msgs/msg/LaserScan", "time_increment"): "s",
    ("sensor_msgs/msg/LaserScan", "scan_time"): "s",
    ("sensor_msgs/msg/LaserScan", "range_min"): "m",
    ("sensor_msgs/msg/LaserScan", "range_max"): "m",
    ("sensor_msgs/msg/LaserScan", "ranges"): "m",
    ("sensor_msgs/msg/BatteryState", "voltage"): "V",
    ("sensor_msgs/msg/BatteryState", "temperature"): "degC",
    ("sensor_msgs/msg/BatteryState", "current"): "A",
    ("sensor_msgs/msg/BatteryState", "charge"): "A h",
    ("sensor_msgs/msg/BatteryState", "capacity"): "A h",
    ("sensor_msgs/msg/BatteryState", "design_capacity"): "A h",
    ("sensor_msgs/msg/BatteryState", "cell_voltage"): "V",
    ("sensor_msgs/msg/BatteryState", "cell_temperature"): "degC",
}

JOINT_UNITS = {"position": "rad or m", "velocity": "rad/s or m/s", "effort": "N m or N"}  # lists of a JointState


def field_units(trees: dict, type_name: str) -> dict:
    """Return field path (dotted, without indices) -> unit, of every field of a type whose unit is known."""
    found = {}

    def visit(name, path, unit):
        for field, node in trees[name]:
            here = UNITS.get((name, field), unit)
            while node[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE):
                node = node[1][0]
            if here:
                found[f"{path}{field}"] = here
            if node[0] == Nodetype.NAME:
                visit(node[1], f"{path}{field}.", here)

    visit(type_name, "", "")
    return found
