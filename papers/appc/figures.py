"""Figures of the Cubli rover's runs, drawn from recorded signals: an overview of one run, and the paper's Fig. 5-46."""

from pathlib import Path

import numpy as np

from flight_graph.claims.claim_runs import RunEntry, identity
from flight_graph.engines.compiled import CompiledRun
from papers.appc.figure_list import ANGLE, EFFORT, ERROR, FEASIBILITY, FIGURES, RATE
from papers.appc.figure_traces import trace
from papers.appc.metrics import (
    COMMAND,
    CONTACT,
    FUNNEL,
    TRUTH,
    contact_history,
    matched,
    seconds,
    until_decided,
)

LINES = {"case 1": "#0b6e99", "case 2": "#c0392b", "case 3": "#2e8b57", "APPC": "#0b6e99", "backstepping": "#c0392b",
         "PD": "#2e8b57", "": "#0b6e99"}
AXES = ("x (phi)", "y (theta)", "z (psi)")
COLOURS = ("#0b6e99", "#c0392b", "#2e8b57")


def overview(scenario, signals, path) -> Path:
    """Attitude in its funnel, rates against eq. (9), the rate funnel and the torques, as one PNG.

    For a law without funnels the normal force stands in the place of the rate funnel; a run that was decided by a
    landing or a fall is drawn up to then.
    """
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    signals = until_decided(scenario, signals)
    truth, funnel = signals[TRUTH], signals.get(FUNNEL)
    t = seconds(truth, scenario)
    values = scenario.graph.nodes["plant"].values
    limit = np.sqrt(np.sqrt(2.0) * values["gravity"] / values["length"])
    torque = matched(t, signals[COMMAND], scenario)
    figure, panels = pyplot.subplots(2, 2, figsize=(12.0, 8.0), layout="constrained", sharex=True)
    attitude, rates, funnels, torques = panels.ravel()
    for axis in range(3):
        attitude.plot(t, truth["angles"][:, axis], color=COLOURS[axis], label=AXES[axis])
        rates.plot(t, truth["rates"][:, axis], color=COLOURS[axis], lw=0.9)
        torques.plot(t, 1e3 * torque[:, axis], color=COLOURS[axis], lw=0.9)
    for sign in (1.0, -1.0):
        rates.axhline(sign * limit, color="k", ls="--", lw=1.0)
    if funnel is not None:
        draw_funnels(attitude, funnels, seconds(funnel, scenario), funnel)
    else:
        normal = signals[CONTACT]["normal_force"] if CONTACT in signals else contact_history(truth, torque, values)[0]
        attitude.set(title="Attitude")
        funnels.plot(t, normal, color=COLOURS[0], lw=0.9)
        funnels.axhline(0.0, color="k", ls="--", lw=1.0)
        funnels.set(title="Normal force; below zero the ground would have to pull", ylabel="N / (m g) [1]")
    rates.plot(t, np.linalg.norm(truth["rates"], axis=1), color="0.45", lw=1.4, label="|omega|")
    attitude.set(ylabel="Cardan angle [rad]")
    rates.set(title="Rates, and the limit of eq. (9) (dashed)", ylabel="rate [rad/s]")
    funnels.set(xlabel="time [s]")
    torques.set(title="Wheel torques", ylabel="torque [mN m]", xlabel="time [s]")
    attitude.legend(frameon=False)
    rates.legend(frameon=False)
    for panel in panels.ravel():
        panel.grid(alpha=0.25)
    figure.suptitle(f"{scenario.file.title} ({scenario.name})")
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)
    return path


def draw_funnels(attitude, panel, t, funnel):
    """The attitude's funnel into its panel, the rate error over its funnel into another."""
    for axis in range(3):
        panel.plot(t, funnel["rate_xi"][:, axis], color=COLOURS[axis], lw=0.9)
    for sign in (1.0, -1.0):
        attitude.plot(t, sign * funnel["attitude_bound"][:, 0], "k--", lw=1.0)
        panel.axhline(sign, color="k", ls="--", lw=1.0)
    attitude.set(title="Attitude, and its funnel (dashed)")
    panel.set(title="Rate error over its funnel: |xi_u| < 1", ylabel="xi_u [1]")


def draw(folder, advance=None, numbers=None, kept=None) -> list[Path]:
    """Draw the paper's figures, one PNG each, from runs made here; return the files.

    advance(done, total, what) is called after each run and figure; numbers: only these figures; kept(scenario) gives
    the signals of a run from its bag (`flight_graph.claims.kept_runs`).
    """
    from matplotlib.figure import Figure
    wanted = [entry for entry in FIGURES if numbers is None or entry.number in numbers]
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    scenarios = {}
    for entry in wanted:
        for run in entry.runs.values():
            scenarios.setdefault(repr(run), RunEntry(**run).scenarios()[""])
    made, traces, logs, files = {}, {}, {}, []
    total = len({identity(scenario) for scenario in scenarios.values()}) + len(wanted)
    for key, scenario in scenarios.items():
        known = identity(scenario)
        if known not in made:
            made[known] = trace(scenario, kept(scenario) if kept else CompiledRun(scenario).run(None, logs))
            if advance:
                advance(len(made), total, scenario.name)
        traces[key] = made[known]
    for entry in wanted:
        figure = Figure(figsize=(7.0, 4.2), layout="constrained")
        _draw_entry(figure, entry, {label: traces[repr(run)] for label, run in entry.runs.items()})
        files.append(folder / f"fig_{entry.number:02d}.png")
        figure.savefig(files[-1], dpi=100)
        if advance:
            advance(len(made) + len(files), total, f"Fig. {entry.number}")
    return files


def _draw_entry(figure, entry, traces):
    figure.suptitle(f"Fig. {entry.number}. {entry.title}", fontsize=11)
    if entry.quantity == FEASIBILITY:
        panels = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
        _feasibility(panels, next(iter(traces.values())))
    else:
        panels = [figure.subplots()]
        for label, run in traces.items():
            _curve(panels[0], entry, run, label)
        if len(traces) > 1:
            panels[0].legend(frameon=False, fontsize=8)
        if entry.quantity == RATE and _shows_limit(traces):
            for sign in (1.0, -1.0):
                panels[0].axhline(sign * next(iter(traces.values())).limit, color="k", ls=":", lw=1.0)
    panels[0].set_title(entry.look, fontsize=8, color="0.35")
    panels[-1].set_xlabel("time [s]")
    for panel in panels:
        panel.grid(alpha=0.25)
        panel.set_xlim(0.0, entry.seconds or max(run.t[-1] for run in traces.values()))


def _shows_limit(traces):
    """Eq. (9) is drawn where it does not flatten the curves."""
    return all(run.limit < 5.0 * np.abs(run.rates).max() for run in traces.values())


def _curve(panel, entry, run, label):
    i, colour = entry.axis, LINES[label]
    bound = None
    if entry.quantity == ANGLE:
        value, bound, unit = run.angles[:, i], run.attitude_bound, f"{('phi', 'theta', 'psi')[i]} [rad]"
    elif entry.quantity == RATE:
        value, unit = run.rates[:, i], f"omega_{'xyz'[i]} [rad/s]"
    elif entry.quantity == ERROR:
        value, bound, unit = run.rate_error[:, i], run.rate_bound, f"e_omega_{'xyz'[i]} [rad/s]"
    elif entry.quantity == EFFORT:
        value, unit = run.effort, "E = integral of u.u dt [N^2 m^2 s]"
    else:
        value, unit = run.torque[:, i], f"u_{'xyz'[i]} [N m]"
    panel.plot(run.t, value, color=colour, lw=1.1, label=label or None)
    if bound is not None:
        for sign in (1.0, -1.0):
            panel.plot(run.t, sign * bound, color=colour if label else "k", ls="--", lw=0.8)
    panel.set_ylabel(unit)


def _feasibility(panels, run):
    rates, force = panels
    for axis in range(3):
        rates.plot(run.t, np.abs(run.rates[:, axis]), color=COLOURS[axis], lw=1.0, label=f"|omega_{'xyz'[axis]}|")
    rates.plot(run.t, np.linalg.norm(run.rates, axis=1), color="0.45", lw=1.3, label="|omega|")
    rates.axhline(run.limit, color="k", ls=":", lw=1.0, label="eq. (9)")
    rates.set_ylabel("rate [rad/s]")
    rates.legend(frameon=False, fontsize=8, ncols=2)
    force.plot(run.t, run.normal_force, color="#6a3d9a", lw=1.1)
    force.axhline(0.0, color="k", ls=":", lw=1.0)
    force.set_ylabel("normal force [m g]")
