"""Figures of the Cubli rover's runs, drawn from recorded signals: an overview of one run, and the paper's Fig. 5-46."""

from pathlib import Path

import numpy as np

from flight_graph.claims.claim_runs import RunEntry, identity
from flight_graph.engines.compiled import CompiledRun
from flight_graph.plots import style
from flight_graph.recordings.what_ran import title
from papers.appc.figure_list import ANGLE, EFFORT, ERROR, FEASIBILITY, FIGURES, GALLERY, RATE
from papers.appc.figure_traces import trace
from papers.appc.metrics import (
    COMMAND,
    CONTACT,
    FUNNEL,
    OUTCOMES,
    TRUTH,
    contact_history,
    matched,
    seconds,
    until_decided,
)

__all__ = ["GALLERY", "draw", "overview"]
LINES = {"case 1": "#0b6e99", "case 2": "#c0392b", "case 3": "#2e8b57", "APPC": "#0b6e99", "backstepping": "#c0392b",
         "PD": "#2e8b57", "": "#0b6e99"}
AXES = ("x (phi)", "y (theta)", "z (psi)")
COLOURS = ("#0b6e99", "#c0392b", "#2e8b57")


def overview(scenario, signals, path) -> Path:
    """Attitude in its funnel, rates against eq. (9), the rate funnel and the torques, as one picture.

    The funnel is that of the attitude error: of a law that tracks a reference the error is drawn, not the attitude. For a
    law without funnels the normal force stands in the place of the rate funnel; a run that was decided by a landing or a
    fall is drawn up to then, and says so.
    """
    signals = until_decided(scenario, signals)
    truth, funnel = signals[TRUTH], signals.get(FUNNEL)
    t = seconds(truth, scenario)
    values = scenario.graph.nodes["plant"].values
    limit = np.sqrt(np.sqrt(2.0) * values["gravity"] / values["length"])
    torque = matched(t, signals[COMMAND], scenario)
    figure = style.new_figure(13.0, 8.0)
    panels = figure.subplots(2, 2, sharex=True)
    attitude, rates, funnels, torques = panels.ravel()
    for axis in range(3):
        rates.plot(t, truth["rates"][:, axis], color=COLOURS[axis], lw=0.9, label=f"omega_{'xyz'[axis]}")
        torques.plot(t, 1e3 * torque[:, axis], color=COLOURS[axis], lw=0.9, label=f"u_{'xyz'[axis]}")
    if funnel is not None:
        draw_funnels(scenario, truth, attitude, funnels, funnel)
    else:
        normal = signals[CONTACT]["normal_force"] if CONTACT in signals else contact_history(truth, torque, values)[0]
        for axis in range(3):
            attitude.plot(t, truth["angles"][:, axis], color=COLOURS[axis], label=AXES[axis])
        attitude.set(title="Attitude", ylabel="Cardan angle [rad]")
        funnels.plot(t, normal, color=COLOURS[0], lw=0.9, label="normal force")
        funnels.axhline(0.0, color="k", ls="--", lw=1.0)
        funnels.set(title="Normal force; below zero the ground would have to pull", ylabel="N / (m g) [1]")
    rates.plot(t, np.linalg.norm(truth["rates"], axis=1), color="0.45", lw=1.4, label="|omega|")
    for sign, label in ((1.0, "eq. (9)"), (-1.0, None)):
        rates.axhline(sign * limit, color="k", ls="--", lw=1.0, label=label)
    rates.set(title="Rates, and the limit of eq. (9)", ylabel="rate [rad/s]")
    funnels.set(xlabel="time [s]")
    torques.set(title="Wheel torques", ylabel="torque [mN m]", xlabel="time [s]")
    for panel in panels.ravel():
        style.legend(panel)
    decided = decision(signals)
    if decided:
        figure.text(0.01, 0.005, f"The run was decided {decided}; drawn until then.", fontsize=10, color="#a93226")
        figure.get_layout_engine().set(rect=(0.0, 0.03, 1.0, 0.97))
    return style.save(figure, path, title(scenario))


def decision(signals) -> str:
    """How and when the contact decided a run, in words; "" of one that stayed up."""
    if CONTACT not in signals or not len(signals[CONTACT]) or signals[CONTACT]["end_time"][-1] < 0.0:
        return ""
    last = signals[CONTACT][-1]
    return f"after {last['end_time']:.4g} s: {OUTCOMES[int(last['outcome'])]}"


def draw_funnels(scenario, truth, attitude, panel, funnel):
    """The angles, or the errors that are held in it, with the attitude's funnel; the rate error over its funnel."""
    t, moves = seconds(funnel, scenario), _reference_moves(scenario)
    for axis in range(3):
        if moves:
            attitude.plot(t, funnel["attitude_error"][:, axis], color=COLOURS[axis], label=f"e_{'xyz'[axis]}")
        else:
            attitude.plot(seconds(truth, scenario), truth["angles"][:, axis], color=COLOURS[axis], label=AXES[axis])
        panel.plot(t, funnel["rate_xi"][:, axis], color=COLOURS[axis], lw=0.9, label=f"xi_{'xyz'[axis]}")
    for sign, label in ((1.0, "funnel"), (-1.0, None)):
        attitude.plot(t, sign * funnel["attitude_bound"][:, 0], "k--", lw=1.0, label=label)
        panel.axhline(sign, color="k", ls="--", lw=1.0)
    attitude.set(title="Error against the reference, and its funnel" if moves else "Attitude, and its funnel",
                 ylabel="error of the Cardan angle [rad]" if moves else "Cardan angle [rad]")
    panel.set(title="Rate error over its funnel: |xi_u| < 1", ylabel="xi_u [1]")


def _reference_moves(scenario) -> bool:
    """Whether the law holds something else than the zero attitude."""
    law = scenario.graph.nodes["controller"].values if "controller" in scenario.graph.nodes else {}
    return law.get("reference_form", "constant") != "constant" or bool(np.any(np.array(law.get("reference", 0.0)) != 0.0))


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
            style.legend(panels[0])
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
    style.legend(rates)
    force.plot(run.t, run.normal_force, color="#6a3d9a", lw=1.1)
    force.axhline(0.0, color="k", ls=":", lw=1.0)
    force.set_ylabel("normal force [m g]")
