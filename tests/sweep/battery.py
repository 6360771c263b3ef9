"""A component with numbers of every kind that a message may have: single precision, whole, true or false, and not finite."""

import math

from flight_graph.components.component import Component
from flight_graph.components.records import Parameters, State, field
from flight_math import kernel, sin
from msg_schemas.qos import Role
from msg_schemas.signal import Signal

BATTERY = Signal("part/battery", "sensor_msgs/msg/BatteryState", Role.TELEMETRY, {"header.frame_id": "part"},
                 may_be_nonfinite=("current",))


class BatteryParameters(Parameters):
    lasts: float = field(0.25, unit="s", gt=0)


class BatteryState(State):
    count: int


@kernel
def discharge(t_ns, p, x, battery):
    t = 1e-9 * t_ns
    x.count += 1
    battery.voltage = 12.0 - t / p.lasts + 0.1 * sin(40.0 * t)
    battery.current = math.nan if t > p.lasts else -t
    battery.power_supply_status = 250 + x.count % 6
    battery.present = x.count % 7 != 3


class Battery(Component):
    """Discharges."""

    parameters, state = BatteryParameters, BatteryState
    outputs = {"battery": BATTERY}
    kernel = discharge
