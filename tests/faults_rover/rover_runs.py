"""Runs of the scenario cubli_faults with one fault, for the tests."""

from pathlib import Path

import numpy as np
import yaml

from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs import metrics
from flight_graph.graphs.fault_scores import times
from flight_graph.graphs.scenario import load

SCENARIOS = Path(__file__).parents[2] / "scenarios"
NEVER = "t > 1000000"
BALANCE, HOLD, REST = 0, 1, 2
CALM = {"plant.disturbance_amplitude": 0.0}


class Run:
    """A finished run: signals by topic without ``cubli/``, metrics, times. more: further faults, with a folder for the file."""

    def __init__(self, at=None, kind="drop", settings=None, duration_s=110.0, more=(), folder=None, **keys):
        overrides = {"duration_s": duration_s, **(settings or {})}
        if at is None:
            overrides["faults.fault.when"] = NEVER
        else:
            overrides |= {"faults.fault.at": at, "faults.fault.type": kind}
            overrides |= {f"faults.fault.{key}": value for key, value in keys.items()}
        file = "cubli_faults"
        if more:
            data = yaml.safe_load((SCENARIOS / "cubli_faults.yaml").read_text())
            data["faults"] += more
            file = folder / "more_faults.yaml"
            file.write_text(yaml.safe_dump(data))
        self.scenario = load(str(file), overrides)
        self.recording = CompiledRun(self.scenario).run()
        self.metrics = metrics.compute(self.scenario, self.recording)

    def __getitem__(self, topic):
        return self.recording[f"cubli/{topic}"]

    def t(self, topic):
        return times(self.scenario, self[topic])

    def at(self, topic, field, t):
        """A field of the newest message of a topic at t [s]."""
        return self[topic][field][np.searchsorted(self.t(topic), t + 1e-9) - 1]

    def modes(self):
        """[(time, mode)] of each change, the first one included."""
        mode, t = self["mode"]["mode"].astype(int), self.t("mode")
        return [(float(t[i]), int(mode[i])) for i in np.flatnonzero(np.diff(mode, prepend=-1))]
