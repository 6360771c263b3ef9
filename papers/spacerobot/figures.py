"""Figures of the space robot: Figs. 8-13 of the paper redrawn from runs, and the overview of one run."""

from pathlib import Path

import numpy as np

from papers.spacerobot.metrics import attitude_errors, matched, seconds

JOINT_NAMES = ("theta 1", "theta 2", "theta 3", "theta 4")
AXIS_NAMES = ("roll", "pitch", "yaw")
PRIOR = {"controller.prior_eta": 0.2}
VARIANCE = {"controller.prior_reading": "variance", "controller.damping_scale": 0.1}
SLOW = {"controller.damping_scale": 0.25, "controller.prior_seed": 7}
DRAWS = tuple(zip(range(101, 107), (0.1, 0.16, 0.22, 0.28, 0.34, 0.4)))  # seeds and eta of six independent priors
MOVING = {"plant.initial_rates": [0.0548311, 0.0, 0.0],  # [rad/s] the harmonics' velocity at t = 0
          "plant.initial_joint_rates": [0.0, 0.1370778, 0.1827704, 0.2741557]}


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
    """The same with four priors: roll error; and the harmonics with six, eq. (46) read as variance, K_D / 10."""
    pyplot = _pyplot()
    figure, panels = pyplot.subplots(1, 2, figsize=(11.0, 4.2), layout="constrained")
    for seed, style in zip(range(1, 5), ("-", "--", "-.", ":")):
        t, attitude, _ = errors(*_run("spacerobot_step", kept, **PRIOR, **{"controller.prior_seed": seed}))
        panels[0].plot(t, attitude[:, 0], style, lw=2.0, label=f"prior {seed}, eta 20 %")
    for seed, eta in DRAWS:
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
    """Harmonic tracking from rest: attitude error; the base's Ixx, Iyy, Izz over the true ones, from rest with ten rows and
    from the harmonics' velocity with seven."""
    pyplot = _pyplot()
    figure, panels = pyplot.subplots(1, 3, figsize=(15.0, 4.2), layout="constrained")
    for name, label, style in (("", "no update", ":"), ("_rls", "least squares", "-"), ("_lyapunov", "Lyapunov", "--")):
        scenario, signals = _run(f"spacerobot_harmonic{name}", kept)
        t, attitude, _ = errors(scenario, signals)
        panels[0].semilogy(t, np.linalg.norm(attitude, axis=1), style, label=label)
        if name:
            _inertia(panels[1], t, signals, label, style)
    seven = {"estimator.rows": "seven", "estimator.covariance": "uniform"}
    for name, label, style, more in (("rls", "least squares", "-", seven), ("lyapunov", "Lyapunov", "--", {})):
        scenario, signals = _run(f"spacerobot_harmonic_{name}", kept, **MOVING, **more)
        _inertia(panels[2], errors(scenario, signals)[0], signals, label, style)
    panels[0].set(ylabel="attitude error [deg]", ylim=(1e-4, 5.0))
    panels[1].set(ylabel="base inertia, estimated over true", ylim=(0.93, 1.05), title="from rest, ten rows")
    panels[2].set(ylim=(0.93, 1.05), title="from the harmonics' velocity, seven rows, G0 uniform")
    return _finish(figure, panels, "Figs. 11, 12: harmonics with both methods, eta 20 %", path, columns=2)


def _inertia(panel, t, signals, label, style):
    """The base's principal elements, estimated over true."""
    estimate, true = signals["spacerobot/parameters"]["pi"], signals["spacerobot/truth/parameters"]["pi"]
    for k, (column, element) in enumerate(((0, "Ixx"), (3, "Iyy"), (5, "Izz"))):
        panel.plot(t, estimate[:, column] / true[:, column], style, color=f"C{k}", label=f"{element}, {label}")


def figure_13(path, kept=None) -> Path:
    """Rms of the attitude error against eta, without update and with both methods: one draw scaled, and six draws."""
    pyplot = _pyplot()
    figure, panels = pyplot.subplots(1, 2, figsize=(11.0, 4.2), layout="constrained", sharey=True)
    methods = (("spacerobot_harmonic", "no update", {}), ("spacerobot_harmonic_rls", "least squares, ten rows", {}),
               ("spacerobot_harmonic_rls", "least squares, seven rows", {"estimator.rows": "seven"}),
               ("spacerobot_harmonic_lyapunov", "Lyapunov, Gamma 0.3 E", {}),
               ("spacerobot_harmonic_lyapunov", "Lyapunov, Gamma 5 prior^2", {"estimator.adaptation": "prior_squared"}))
    draws = [[(7, eta) for eta in (0.1, 0.2, 0.3, 0.4)], DRAWS]
    for panel, priors, title in zip(panels, draws, ("one draw of the prior, scaled", "six independent draws")):
        for name, label, more in methods:
            values = []
            for seed, eta in priors:
                own = {**SLOW, **more, "controller.prior_seed": seed, "controller.prior_eta": eta}
                t, attitude, _ = errors(*_run(name, kept, **own))
                values.append(np.sqrt(np.mean(np.sum(attitude[t >= 20.0] ** 2, axis=1))))
            panel.plot([100.0 * eta for _, eta in priors], values, "o-", label=label)
        panel.set(xlabel="eta [%]", title=title, ylim=(0.0, None))
    panels[0].set_ylabel("attitude rms, t >= 20 s [deg]")
    return _finish(figure, panels, "Fig. 13: error against the prior's, K_D / 4", path)


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
