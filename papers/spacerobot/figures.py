"""Figures of the space robot: Figs. 8-13 of the paper redrawn from runs, and the overview of one run."""

from pathlib import Path

import numpy as np

from papers.spacerobot.metrics import attitude_errors, matched, seconds

JOINT_NAMES = ("theta 1", "theta 2", "theta 3", "theta 4")
AXIS_NAMES = ("roll", "pitch", "yaw")
PRIOR = {"controller.prior_eta": 0.2}
VARIANCE = {"controller.prior_reading": "variance", "controller.damping_scale": 0.1}
SLOW = {"controller.damping_scale": 0.25, "controller.prior_seed": 7}


def overview(scenario, signals, path) -> Path:
    """Attitude error, joint errors, torques, and the torque that the estimate mispredicts, as one PNG."""
    pyplot = _pyplot()
    figure, panels = pyplot.subplots(2, 2, figsize=(12.0, 8.0), layout="constrained", sharex=True)
    t, attitude, joints = errors(scenario, signals)
    for k in range(3):
        panels[0, 0].plot(t, attitude[:, k], label=AXIS_NAMES[k])
    for i in range(joints.shape[1]):
        panels[0, 1].plot(t, joints[:, i], label=f"theta {i + 1}")
    law = signals["spacerobot/control"]
    panels[1, 0].plot(seconds(law, scenario), law["torque"], lw=0.9)
    panels[0, 0].set(title="Attitude error", ylabel="[deg]")
    panels[0, 1].set(title="Joint errors", ylabel="[deg]")
    panels[1, 0].set(title="Torques of base and joints", ylabel="[N m]", xlabel="time [s]")
    if "spacerobot/truth/prediction" in signals:
        found = signals["spacerobot/truth/prediction"]
        panels[1, 1].semilogy(seconds(found, scenario), np.maximum(found["prediction_error"], 1e-12))
        panels[1, 1].set(title="Torque mispredicted by the estimate", ylabel="[N m]", xlabel="time [s]")
    else:
        truth = signals["spacerobot/truth"]
        panels[1, 1].plot(t, truth["kinetic_energy"])
        panels[1, 1].set(title="Kinetic energy", ylabel="[J]", xlabel="time [s]")
    for panel in panels[0]:
        panel.legend(frameon=False)
    return _save(figure, f"{scenario.file.title} ({scenario.name})", path)


def draw(folder, advance=None, kept=None) -> list[Path]:
    """Draw all figures of the paper into a folder. advance(done, total, what) is called after each.

    kept(scenario) gives the signals of a run from its bag (`flight_graph.claims.kept_runs`).
    """
    folder, made = Path(folder), []
    jobs = [("fig8", figure_8), ("fig9", figure_9), ("fig10", figure_10), ("fig11_12", figure_11_12),
            ("fig13", figure_13)]
    for number, (name, function) in enumerate(jobs):
        made.append(function(folder / f"spacerobot_{name}.png", kept))
        if advance:
            advance(number + 1, len(jobs), name)
    return made


def errors(scenario, signals) -> tuple:
    """t [s], attitude errors (m, 3) and joint errors (m, n) in deg."""
    truth = signals["spacerobot/truth"]
    t = seconds(truth, scenario)
    reference = matched(t, signals["spacerobot/reference"], scenario)
    return t, np.degrees(attitude_errors(truth["attitude"], reference["attitude"])), np.degrees(
        reference["joints"] - truth["joints"])


def figure_8(path, kept=None) -> Path:
    """Orientation task with true parameters."""
    pyplot = _pyplot()
    figure, panels = pyplot.subplots(1, 2, figsize=(11.0, 4.2), layout="constrained")
    t, attitude, joints = errors(*_run("spacerobot_step", kept))
    for k in range(3):
        panels[0].plot(t, attitude[:, k], label=AXIS_NAMES[k])
    for i in range(joints.shape[1]):
        panels[1].plot(t, joints[:, i], label=JOINT_NAMES[i])
    panels[0].set(ylabel="attitude error [deg]", xlim=(0.0, 20.0))
    panels[1].set(ylabel="joint errors [deg]", xlim=(0.0, 20.0))
    return _finish(figure, panels, "Fig. 8: orientation task, true parameters", path)


def figure_9(path, kept=None) -> Path:
    """The same with four priors: roll error; and the harmonics with eq. (46) read as variance, K_D / 10."""
    pyplot = _pyplot()
    figure, panels = pyplot.subplots(1, 2, figsize=(11.0, 4.2), layout="constrained")
    for seed, style in zip(range(1, 5), ("-", "--", "-.", ":")):
        t, attitude, _ = errors(*_run("spacerobot_step", kept, **PRIOR, **{"controller.prior_seed": seed}))
        panels[0].plot(t, attitude[:, 0], style, lw=2.0, label=f"prior {seed}, eta 20 %")
    for seed, eta in ((101, 0.1), (102, 0.16), (103, 0.22), (104, 0.28)):
        t, attitude, _ = errors(*_run("spacerobot_harmonic", kept, **VARIANCE, **{
            "controller.prior_seed": seed, "controller.prior_eta": eta}))
        panels[1].semilogy(t, np.linalg.norm(attitude, axis=1), label=f"prior {seed}, eta {100.0 * eta:g} %")
    panels[0].set(ylabel="roll error [deg]", xlim=(0.0, 20.0), title="step, eq. (46) as printed: nothing diverges")
    panels[1].set(ylabel="attitude error [deg]", ylim=(1e-2, 50.0), title="harmonics, eq. (46) as variance, K_D / 10")
    return _finish(figure, panels, "Fig. 9: parameters known before flight only, no update", path)


def figure_10(path, kept=None) -> Path:
    """Lambda from 0.4 to 2, printed law and the reading that shows the paper's trend."""
    pyplot = _pyplot()
    figure, panels = pyplot.subplots(1, 2, figsize=(11.0, 4.2), layout="constrained")
    for panel, form in zip(panels, ("slotine_li", "desired_feedforward")):
        for gain in (0.4, 0.8, 1.2, 1.6, 2.0):
            t, attitude, _ = errors(*_run("spacerobot_step", kept, **{
                "controller.gain": gain, "controller.form": form}))
            panel.plot(t, attitude[:, 0], label=f"Lambda {gain:g}")
        panel.set_title(form)
        panel.set(xlim=(0.0, 20.0), ylabel="roll error [deg]")
    return _finish(figure, panels, "Fig. 10: roll error, printed law and reading", path)


def figure_11_12(path, kept=None) -> Path:
    """Harmonic tracking: attitude error, and the base's Ixx, Iyy, Izz over the true ones."""
    pyplot = _pyplot()
    figure, panels = pyplot.subplots(1, 2, figsize=(11.0, 4.2), layout="constrained")
    for name, label, style in (("rls", "least squares", "-"), ("lyapunov", "Lyapunov", "--")):
        scenario, signals = _run(f"spacerobot_harmonic_{name}", kept)
        t, attitude, _ = errors(scenario, signals)
        panels[0].semilogy(t, np.linalg.norm(attitude, axis=1), style, label=label)
        estimate, true = signals["spacerobot/parameters"]["pi"], signals["spacerobot/truth/parameters"]["pi"]
        for k, (column, element) in enumerate(((0, "Ixx"), (3, "Iyy"), (5, "Izz"))):
            panels[1].plot(t, estimate[:, column] / true[:, column], style, color=f"C{k}", label=f"{element}, {label}")
    panels[0].set(ylabel="attitude error [deg]", ylim=(1e-4, 5.0))
    panels[1].set(ylabel="base inertia, estimated over true", ylim=(0.93, 1.05))
    figure_title = "Figs. 11, 12: harmonics with least squares and with Lyapunov's law, eta 20 %"
    return _finish(figure, panels, figure_title, path, columns=2)


def figure_13(path, kept=None) -> Path:
    """Rms of the attitude error against eta for no update, least squares and Lyapunov's law."""
    pyplot = _pyplot()
    figure, panel = pyplot.subplots(figsize=(6.5, 4.2), layout="constrained")
    etas = (0.1, 0.2, 0.3, 0.4)
    for name, label in (("spacerobot_harmonic", "no update"), ("spacerobot_harmonic_rls", "least squares"),
                        ("spacerobot_harmonic_lyapunov", "Lyapunov")):
        values = []
        for eta in etas:
            t, attitude, _ = errors(*_run(name, kept, **{**SLOW, "controller.prior_eta": eta}))
            values.append(np.sqrt(np.mean(np.sum(attitude[t >= 20.0] ** 2, axis=1))))
        panel.plot(100.0 * np.array(etas), values, "o-", label=label)
    panel.set(xlabel="eta [%]", ylabel="attitude rms, t >= 20 s [deg]", ylim=(0.0, None))
    return _finish(figure, [panel], "Fig. 13: error against the prior's, K_D / 4", path)


def _run(name, kept, **overrides):
    from flight_graph.graphs.scenario import load
    from flight_graph.runs import simulate
    scenario = load(name, overrides)
    return scenario, (kept or simulate)(scenario)


def _pyplot():
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    return pyplot


def _finish(figure, panels, title, path, columns=1):
    for panel in panels:
        panel.legend(frameon=False, fontsize=8, ncols=columns)
        if not panel.get_xlabel():
            panel.set_xlabel("time [s]")
    return _save(figure, title, path)


def _save(figure, title, path):
    for panel in figure.axes:
        panel.grid(alpha=0.25)
    figure.suptitle(title)
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
    _pyplot().close(figure)
    return path
