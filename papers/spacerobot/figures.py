"""Figures of the space robot: Figs. 8-13 of the paper redrawn from runs, and the overview of one run."""

from pathlib import Path

import numpy as np

from flight_graph.plots import style
from flight_graph.recordings.what_ran import title
from papers.spacerobot.metrics import attitude_errors, matched, seconds

GALLERY = [  # file, caption, numbers in the paper, rows of claims that are judged on it besides
    ("spacerobot_fig8.png", "Fig. 8. Orientation task, true parameters: attitude and joints come to rest on their targets",
     (8,), ()),
    ("spacerobot_fig9.png", "Fig. 9. Parameters known before flight only: nothing diverges with the law as printed",
     (9,), ()),
    ("spacerobot_fig10.png", "Fig. 10. Roll error for Lambda 0.4 to 2: by the printed law a larger Lambda is faster; the "
     "reading with the desired motion fed forward shows the paper's trend", (10,), ()),
    ("spacerobot_fig11_12.png", "Figs. 11, 12. Harmonics with both methods: attitude error, and the base's inertia as it "
     "is estimated", (11, 12), ()),
    ("spacerobot_fig13.png", "Fig. 13. Attitude error against how wrong the prior is: one draw scaled, and six draws",
     (13,), ()),
]
JOINT_NAMES = ("theta 1", "theta 2", "theta 3", "theta 4")
AXIS_NAMES = ("roll", "pitch", "yaw")
PRIOR = {"controller.prior_eta": 0.2}
VARIANCE = {"controller.prior_reading": "variance", "controller.damping_scale": 0.1}
SLOW = {"controller.damping_scale": 0.25, "controller.prior_seed": 7}
DRAWS = tuple(zip(range(101, 107), (0.1, 0.16, 0.22, 0.28, 0.34, 0.4)))  # seeds and eta of six independent priors
MOVING = {"plant.initial_rates": [0.0548311, 0.0, 0.0],  # [rad/s] the harmonics' velocity at t = 0
          "plant.initial_joint_rates": [0.0, 0.1370778, 0.1827704, 0.2741557]}


def overview(scenario, signals, path) -> Path:
    """Attitude error, joint errors, torques, and the torque that the estimate mispredicts, as one picture."""
    figure = style.new_figure(13.0, 8.0)
    panels = figure.subplots(2, 2, sharex=True)
    t, attitude, joints = errors(scenario, signals)
    for k in range(3):
        panels[0, 0].plot(t, attitude[:, k], label=AXIS_NAMES[k])
    for i in range(joints.shape[1]):
        panels[0, 1].plot(t, joints[:, i], label=f"theta {i + 1}")
    law = signals["spacerobot/control"]
    for k, name in enumerate(torque_names(law["torque"].shape[1])):
        panels[1, 0].plot(seconds(law, scenario), law["torque"][:, k], style.DASHES[0 if k < 3 else 1], lw=0.9, label=name,
                          color=style.COLOURS[k % len(style.COLOURS)])
    panels[0, 0].set(title="Attitude error", ylabel="[deg]")
    panels[0, 1].set(title="Joint errors", ylabel="[deg]")
    panels[1, 0].set(title="Torques of base and joints", ylabel="[N m]", xlabel="time [s]")
    if "spacerobot/truth/prediction" in signals:
        found = signals["spacerobot/truth/prediction"]
        panels[1, 1].semilogy(seconds(found, scenario), np.maximum(found["prediction_error"], 1e-12),
                              label="|Y (pi_hat - pi)|")
        panels[1, 1].set(title="Mispredicted torque", ylabel="[N m]", xlabel="time [s]")
    else:
        truth = signals["spacerobot/truth"]
        panels[1, 1].plot(seconds(truth, scenario), truth["kinetic_energy"], label="kinetic energy")
        panels[1, 1].set(title="Kinetic energy", ylabel="[J]", xlabel="time [s]")
    for panel in panels.ravel():
        style.legend(panel)
    return style.save(figure, path, title(scenario))


def torque_names(count: int) -> list[str]:
    """What the law's torques are called: three of the base, one a joint."""
    return [*(f"base {name}" for name in AXIS_NAMES), *(f"joint {k + 1}" for k in range(count - 3))]


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
    figure = style.new_figure(13.0, 4.2)
    panels = figure.subplots(1, 2)
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
    figure = style.new_figure(13.0, 4.2)
    panels = figure.subplots(1, 2)
    for seed, dash in zip(range(1, 5), ("-", "--", "-.", ":")):
        t, attitude, _ = errors(*_run("spacerobot_step", kept, **PRIOR, **{"controller.prior_seed": seed}))
        panels[0].plot(t, attitude[:, 0], dash, lw=2.0, label=f"prior {seed}, eta 20 %")
    for seed, eta in DRAWS:
        t, attitude, _ = errors(*_run("spacerobot_harmonic", kept, **VARIANCE, **{
            "controller.prior_seed": seed, "controller.prior_eta": eta}))
        panels[1].semilogy(t, np.linalg.norm(attitude, axis=1), label=f"prior {seed}, eta {100.0 * eta:g} %")
    panels[0].set(ylabel="roll error [deg]", xlim=(0.0, 20.0), title="step, eq. (46) as printed: nothing diverges")
    panels[1].set(ylabel="attitude error [deg]", ylim=(1e-2, 50.0), title="harmonics, eq. (46) as variance, K_D / 10")
    return _finish(figure, panels, "Fig. 9: parameters known before flight only, no update", path)


def figure_10(path, kept=None) -> Path:
    """Lambda from 0.4 to 2, printed law and the reading that shows the paper's trend."""
    figure = style.new_figure(13.0, 4.2)
    panels = figure.subplots(1, 2)
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
    figure = style.new_figure(18.0, 4.2)
    panels = figure.subplots(1, 3)
    for name, label, dash in (("", "no update", ":"), ("_rls", "least squares", "-"), ("_lyapunov", "Lyapunov", "--")):
        scenario, signals = _run(f"spacerobot_harmonic{name}", kept)
        t, attitude, _ = errors(scenario, signals)
        panels[0].semilogy(t, np.linalg.norm(attitude, axis=1), dash, label=label)
        if name:
            _inertia(panels[1], t, signals, label, dash)
    seven = {"estimator.rows": "seven", "estimator.covariance": "uniform"}
    for name, label, dash, more in (("rls", "least squares", "-", seven), ("lyapunov", "Lyapunov", "--", {})):
        scenario, signals = _run(f"spacerobot_harmonic_{name}", kept, **MOVING, **more)
        _inertia(panels[2], errors(scenario, signals)[0], signals, label, dash)
    panels[0].set(ylabel="attitude error [deg]", ylim=(1e-4, 5.0))
    panels[1].set(ylabel="base inertia, estimated over true", ylim=(0.93, 1.05), title="from rest, ten rows")
    panels[2].set(ylim=(0.93, 1.05), title="from the harmonics' velocity, seven rows, G0 uniform")
    return _finish(figure, panels, "Figs. 11, 12: harmonics with both methods, eta 20 %", path)


def _inertia(panel, t, signals, label, dash):
    """The base's principal elements, estimated over true."""
    estimate, true = signals["spacerobot/parameters"]["pi"], signals["spacerobot/truth/parameters"]["pi"]
    for k, (column, element) in enumerate(((0, "Ixx"), (3, "Iyy"), (5, "Izz"))):
        panel.plot(t, estimate[:, column] / true[:, column], dash, color=f"C{k}", label=f"{element}, {label}")


def figure_13(path, kept=None) -> Path:
    """Rms of the attitude error against eta, without update and with both methods: one draw scaled, and six draws."""
    figure = style.new_figure(13.0, 4.2)
    panels = figure.subplots(1, 2, sharey=True)
    methods = (("spacerobot_harmonic", "no update", {}), ("spacerobot_harmonic_rls", "least squares, ten rows", {}),
               ("spacerobot_harmonic_rls", "least squares, seven rows", {"estimator.rows": "seven"}),
               ("spacerobot_harmonic_lyapunov", "Lyapunov, Gamma 0.3 E", {}),
               ("spacerobot_harmonic_lyapunov", "Lyapunov, Gamma 5 prior^2", {"estimator.adaptation": "prior_squared"}))
    draws = [[(7, eta) for eta in (0.1, 0.2, 0.3, 0.4)], DRAWS]
    for panel, priors, heading in zip(panels, draws, ("one draw of the prior, scaled", "six independent draws")):
        for name, label, more in methods:
            values = []
            for seed, eta in priors:
                own = {**SLOW, **more, "controller.prior_seed": seed, "controller.prior_eta": eta}
                t, attitude, _ = errors(*_run(name, kept, **own))
                values.append(np.sqrt(np.mean(np.sum(attitude[t >= 20.0] ** 2, axis=1))))
            panel.plot([100.0 * eta for _, eta in priors], values, "o-", label=label)
        panel.set(xlabel="eta [%]", title=heading, ylim=(0.0, None))
    panels[0].set_ylabel("attitude rms, t >= 20 s [deg]")
    return _finish(figure, panels, "Fig. 13: error against the prior's, K_D / 4", path)


def _run(name, kept, **overrides):
    from flight_graph.graphs.scenario import load
    from flight_graph.runs import simulate
    scenario = load(name, overrides)
    return scenario, (kept or simulate)(scenario)


def _finish(figure, panels, heading, path):
    for panel in panels:
        style.legend(panel)
        if not panel.get_xlabel():
            panel.set_xlabel("time [s]")
    return style.save(figure, path, heading)
