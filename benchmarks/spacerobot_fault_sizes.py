"""How small a fault the space robot's monitors see: sizes of eleven faults, four seeds each, and 100 seeds without a fault.

    python benchmarks/spacerobot_fault_sizes.py

Prints the table of docs/faults_spacerobot.md.
"""

from statistics import median

from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs import metrics
from flight_graph.graphs.scenario import load

JOINTS = "joint_sensors.joints"
SIZES = {  # (place, type, unit) -> values
    ("imu.imu.angular_velocity[0]", "bias", "gyro"): (5e-5, 1e-4, 2e-4, 5e-4),  # [rad/s]
    ("star_tracker.measured.quaternion[2]", "bias", "star_tracker"): (2e-5, 5e-5, 1e-4, 5e-4),  # [1] half an angle
    (f"{JOINTS}.position[1]", "bias", "encoder_2"): (5e-5, 1e-4, 2e-4, 1e-3),  # [rad]
    (f"{JOINTS}.velocity[1]", "bias", "joint_rate_2"): (5e-4, 1e-3, 5e-3),  # [rad/s]
    ("plant.parameters.joint_friction[1]", "stuck", "joint_2"): (0.005, 0.01, 0.02),  # [N m]
    ("plant.parameters.joint_friction[3]", "stuck", "joint_4"): (0.001, 0.002, 0.005),  # [N m]
    ("plant <- joint_command.effort[1]", "scale", "drive_2"): (0.9, 0.8, 0.5),
    ("plant.parameters.wheel_drag[0]", "stuck", "wheel_x"): (0.002, 0.005, 0.01),  # [N m]
    ("plant <- base_command.wrench.torque[0]", "scale", "wheel_x"): (0.9, 0.8, 0.5),
    ("imu.imu.linear_acceleration[0]", "bias", "accelerometer"): (0.01, 0.02, 0.05),  # [m/s^2]
    (f"{JOINTS}.effort[1]", "bias", "torque_2"): (0.005, 0.01, 0.02),  # [N m]
}


def judged(seed, **fault) -> dict:
    """Metrics of one run with a fault from 8 s on."""
    scenario = load("spacerobot_faults", {"seed": seed, **{f"faults.fault.{key}": value for key, value in fault.items()}})
    return metrics.compute(scenario, CompiledRun(scenario).run())


def main() -> None:
    alarms = sum(judged(seed)["false_alarms"] > 0 for seed in range(1, 101))
    print(f"no fault: {alarms} of 100 runs with an alarm")
    print("| place | type | size | detected | isolated | wrong | delay [s] |\n|---|---|---|---|---|---|---|")
    for (at, kind, unit), values in SIZES.items():
        for value in values:
            rows = [judged(seed, at=at, type=kind, unit=unit, value=value, from_s=8) for seed in (1, 2, 3, 4)]
            delays = [row["fault_detection_delay_s"] for row in rows if row["fault_detected"]]
            right, wrong = (sum(row["fault_isolated"] is told for row in rows) for told in (True, False))
            delay = f"{median(delays):.2f}" if delays else "-"
            print(f"| `{at}` | {kind} | {value:g} | {len(delays)}/4 | {right} | {wrong} | {delay} |", flush=True)


if __name__ == "__main__":
    main()
