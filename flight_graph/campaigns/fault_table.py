"""A sweep over a catalogue of faults, as a table: each fault, how its runs were met by the monitors, and how they ended."""

from collections import Counter
from dataclasses import dataclass, field
from statistics import median


@dataclass
class FaultRow:
    """The runs of one variant of a sweep. by: actionpoint -> runs in which it was the first to act after the onset."""

    name: str
    runs: int = 0
    active: int = 0  # runs in which the fault became active
    detected: int = 0
    isolated: int = 0
    wrong: int = 0  # runs in which units were blamed that had not failed
    false_alarms: int = 0  # runs with an act before the fault
    stopped: int = 0
    delays_s: list = field(default_factory=list)
    by: Counter = field(default_factory=Counter)
    modes: Counter = field(default_factory=Counter)

    @property
    def missed(self) -> int:
        return self.active - self.detected

    def plain(self) -> dict:
        """The row for a machine."""
        return {"name": self.name, "runs": self.runs, "active": self.active, "detected": self.detected,
                "missed": self.missed, "isolated": self.isolated, "wrong": self.wrong, "false_alarms": self.false_alarms,
                "stopped": self.stopped, "median_delay_s": median(self.delays_s) if self.delays_s else None,
                "by": dict(self.by), "modes": dict(self.modes)}


def faults_of(campaign) -> list[FaultRow]:
    """The table of a campaign (`flight_graph.campaigns.folder.Campaign`); [] where its runs have no faults, no monitors."""
    return fault_rows(campaign.rows()) if "false_alarms" in campaign.schema().names else []


def fault_rows(rows) -> list[FaultRow]:
    """The table of a campaign's rows, one line a variant (`vary.cases`); [] where its runs have no faults, no monitors.

    rows: of `flight_graph.campaigns.rows.Row`.
    """
    found, judged_at_all = {}, False
    for row in rows:
        line = found.setdefault(row.name or "all", FaultRow(row.name or "all"))
        line.runs += 1
        if row.status != "ok":
            line.stopped += 1
        judged = row.metrics
        if "false_alarms" not in judged:
            continue
        judged_at_all = True
        line.false_alarms += judged["false_alarms"] > 0
        if "final_mode" in judged:
            line.modes[judged["final_mode"]] += 1
        if judged.get("fault_onset_s") is None:
            continue
        line.active += 1
        line.isolated += judged["fault_isolated"] is True
        line.wrong += judged["fault_isolated"] is False
        if judged["fault_detected"]:
            line.detected += 1
            line.delays_s.append(judged["fault_detection_delay_s"])
            line.by[judged["fault_detected_by"]] += 1
    return list(found.values()) if judged_at_all else []


def draw(rows: list[FaultRow], path) -> None:
    """Draw the table fault by monitor: in what share of its runs each actionpoint was the first to act."""
    import matplotlib
    matplotlib.use("Agg")
    import numpy as np
    from matplotlib import pyplot
    monitors = sorted({name for row in rows for name in row.by})
    columns = [*monitors, "missed", "blamed wrongly", "false alarm"]
    shares = np.array([[*(row.by[name] / max(1, row.active) for name in monitors), row.missed / max(1, row.active),
                        row.wrong / max(1, row.active), row.false_alarms / max(1, row.runs)] for row in rows])
    figure, axes = pyplot.subplots(figsize=(2.5 + 0.6 * len(columns), 1.5 + 0.26 * len(rows)), layout="constrained")
    image = axes.imshow(shares, vmin=0.0, vmax=1.0, cmap="viridis", aspect="auto")
    axes.set_xticks(range(len(columns)), columns, rotation=45, ha="right", fontsize=8)
    axes.set_yticks(range(len(rows)), [row.name for row in rows], fontsize=8)
    axes.set_title("share of the runs of each fault", fontsize=9)
    figure.colorbar(image, ax=axes, shrink=0.6)
    figure.savefig(path, dpi=150)
    pyplot.close(figure)
