"""Figures of the landing, drawn from recorded signals; nothing needs a display."""

from pathlib import Path

import numpy as np

from flight_graph.plots import style
from flight_graph.recordings.what_ran import title
from papers.lander import energy
from papers.lander.metrics import seconds

COLOURS = ("#0b6e99", "#c0392b", "#2e8b57")
GALLERY = [  # file, caption, numbers in the paper (its figures are not public), rows of claims that are judged on it
    ("lander_nominal.png", "The nominal landing: path, constraints, errors, potential", (),
     ("touches-down", "desired-attitude", "collision-avoidance", "line-of-sight", "lyapunov-falls", "nominal-numbers")),
    ("lander_constraints.png", "What each term of the potential is for: the same start without it", (),
     ("both-needed", "funnel-and-ground", "lyapunov-rate")),
    ("lander_unconstrained.png", "Without the constraint terms", (), ("price",)),
    ("lander_pd.png", "A PD law in its place", (), ("coriolis-baseline",)),
    ("lander_estimated.png", "On its own navigation", (), ("navigation", "lyapunov-falls-always")),
    ("lander_monte_carlo.png", "200 random starts, with perfect and with noisy navigation", (),
     ("monte-carlo", "monte-carlo-perturbed")),
]


def flight(scenario, signals, topic):
    """Time [s] and records of a topic up to the contact."""
    records = signals[topic]
    t = seconds(records, scenario)
    last = signals["lander/truth/summary"][-1]
    end = float(last["time"]) if last["landed"] else np.inf
    return t[t <= end], records[t <= end]


def overview(scenario, signals, path) -> Path:
    """Path over the keep-out funnel, clearance, line of sight, errors, velocities, wrench, potential, as one picture."""
    figure = style.new_figure(18.0, 11.0)
    grid = figure.add_gridspec(4, 3, width_ratios=(1.3, 1.0, 1.0))
    draw_path(figure.add_subplot(grid[:3, 0], projection="3d"), scenario, signals)
    panels = [figure.add_subplot(grid[row, column]) for row in range(4) for column in (1, 2)]
    draw_constraints(panels[0], panels[1], scenario, signals)
    draw_errors(panels[2], panels[3], scenario, signals)
    draw_velocities(panels[4], scenario, signals)
    draw_potential(panels[5], scenario, signals)
    draw_wrench(panels[6], panels[7], scenario, signals)
    words = figure.add_subplot(grid[3, 0])
    words.axis("off")
    words.text(0.02, 0.9, ending(scenario, signals), va="top", fontsize=11, wrap=True)
    for panel in panels:
        style.legend(panel)
    for panel in panels[-2:]:
        panel.set_xlabel("time [s]")
    return style.save(figure, path, title(scenario))


def ending(scenario, signals) -> str:
    """How the landing ended, in words."""
    last = signals["lander/truth/summary"][-1]
    if not last["landed"]:
        return f"Not landed within {scenario.duration_ns / 1e9:g} s."
    return (f"Landed after {last['time']:.4g} s; drawn until then.\n{last['lateral']:.3g} m from the site, "
            f"{last['speed']:.3g} m/s, {np.degrees(last['attitude_error']):.3g} deg.")


def draw_path(panel, scenario, signals):
    """The path in D over the surface d = 0."""
    _, truth = flight(scenario, signals, "lander/truth")
    values = scenario.graph.nodes["plant"].values
    x, y, z = truth["site_position"].T
    reach = 1.1 * max(np.abs(x).max(), np.abs(y).max())
    grid_x, grid_y = np.meshgrid(np.linspace(-reach, 0.4 * reach, 60), np.linspace(-0.6 * reach, 0.7 * reach, 60))
    panel.plot_surface(grid_x, grid_y, keep_out(values, grid_x, grid_y), color="#c9b79c", alpha=0.45, linewidth=0)
    panel.plot(x, y, z, color=COLOURS[0], lw=1.8)
    panel.plot(x, y, keep_out(values, x, y), color=COLOURS[1], lw=0.9, ls="--")
    panel.scatter([0.0], [0.0], [0.0], color="k", s=18)
    panel.set(title="Path over the keep-out funnel", xlabel="x east [m]", ylabel="y [m]", zlabel="z [m]")


def keep_out(values, x, y):
    """Height [m] of the surface d = 0 in D."""
    rho_2 = values["funnel_rho_0"] ** 2
    return ((values["funnel_alpha"] * (x * x + values["funnel_beta"] * y * y + rho_2)) ** values["funnel_gamma"]
            - (values["funnel_alpha"] * rho_2) ** values["funnel_gamma"] - values["funnel_z_0"])


def draw_constraints(clearance, view, scenario, signals):
    """Clearance against 0 and line of sight against the cone."""
    t, truth = flight(scenario, signals, "lander/truth")
    distance = np.linalg.norm(truth["site_position"], axis=1)
    clearance.plot(t, truth["clearance"], color=COLOURS[0])
    clearance.axhline(0.0, color="k", ls="--", lw=1.0)
    clearance.set(title="Clearance d over the keep-out funnel (limit dashed)", ylabel="d [m]")
    degrees = np.degrees(truth["view_angle"])
    far = distance > scenario.graph.nodes["plant"].values["view_range"]
    view.plot(t, np.where(far, degrees, np.nan), color=COLOURS[0])
    view.axhline(np.degrees(scenario.graph.nodes["plant"].values["view_half_angle"]), color="k", ls="--", lw=1.0)
    view.set(title="Line of sight to the site, |r| > 5 m (limit dashed)", ylabel="angle [deg]")


def draw_errors(position, attitude, scenario, signals):
    """Distance per axis, and the angle to the goal's attitude."""
    t, truth = flight(scenario, signals, "lander/truth")
    for axis, name in enumerate("xyz"):
        position.plot(t, truth["site_position"][:, axis], color=COLOURS[axis], label=f"{name} (D)")
    position.set(title="Position error", ylabel="r [m]")
    turn = 2.0 * np.arcsin(np.clip(np.linalg.norm(truth["attitude"][:, :3], axis=1), 0.0, 1.0))
    attitude.semilogy(t, np.maximum(np.degrees(turn), 1e-4), color=COLOURS[0])
    attitude.set(title="Attitude error", ylabel="angle [deg]")


def draw_velocities(panel, scenario, signals):
    """Speed relative to the site, and turn rate."""
    t, truth = flight(scenario, signals, "lander/truth")
    panel.plot(t, np.linalg.norm(truth["site_velocity"], axis=1), color=COLOURS[0], label="speed [m/s]")
    panel.plot(t, np.degrees(np.linalg.norm(truth["rates"], axis=1)), color=COLOURS[1], label="rate [deg/s]")
    style.legend(panel)
    panel.set(title="Velocities relative to the site", ylabel="m/s, deg/s")


def draw_wrench(force, torque, scenario, signals):
    """Commanded force and torque in B."""
    t, command = flight(scenario, signals, "lander/cmd_wrench")
    for axis, name in enumerate("xyz"):
        force.plot(t, command["wrench"]["force"][:, axis], color=COLOURS[axis], lw=0.9, label=name)
        torque.plot(t, command["wrench"]["torque"][:, axis], color=COLOURS[axis], lw=0.9, label=name)
    force.set(title="Force in B", ylabel="force [N]")
    torque.set(title="Torque in B", ylabel="torque [N m]")
    torque.set_xscale("symlog", linthresh=1.0)


def draw_potential(panel, scenario, signals):
    """Potential, Lyapunov function and how fast it falls; empty for a law without them."""
    panel.set(title="Potential and its decay")
    if "lander/constraints" not in signals:
        panel.text(0.5, 0.5, "this law has no potential", ha="center", transform=panel.transAxes)
        return
    t, law = flight(scenario, signals, "lander/constraints")
    panel.semilogy(t, np.maximum(law["lyapunov"], 1e-6), color=COLOURS[0], label="L [J]")
    panel.semilogy(t, np.maximum(law["potential_terms"][:, 2], 1e-6), color=COLOURS[2], lw=0.9, label="terrain [J]")
    panel.semilogy(t, np.maximum(-law["lyapunov_rate"], 1e-6), color=COLOURS[1], lw=0.9, label="-dL/dt [W]")
    panel.set(ylabel="J, W", ylim=(1e-4, None))
    style.legend(panel)


def dispersion(scenario, signals, path) -> Path:
    """Overview of one case of the Monte Carlo, which records its tally alone: how it went, over time."""
    t, tally = flight(scenario, signals, "lander/truth/summary")
    figure = style.new_figure(11.0, 7.5)
    panels = figure.subplots(2, 2, sharex=True)
    for panel, (name, scale, label) in zip(panels.ravel(), (
            ("lateral", 1.0, "lateral distance [m]"), ("speed", 1.0, "speed [m/s]"),
            ("attitude_error", np.degrees(1.0), "attitude error [deg]"), ("delta_v", 1.0, "delta-v [m/s]"))):
        panel.plot(t, scale * tally[name], color=COLOURS[0])
        panel.set(ylabel=label)
        panel.grid(alpha=0.25)
    panels[1, 0].set_xlabel("time [s]")
    panels[1, 1].set_xlabel("time [s]")
    figure.supxlabel(ending(scenario, signals), fontsize=10)
    return style.save(figure, path, title(scenario))


def scatter(rows: dict, path) -> Path:
    """Monte Carlo dispersion. rows: title -> list of metrics of its runs."""
    figure = style.new_figure(16.0, 4.6)
    panels = figure.subplots(1, 3)
    for colour, (label, found) in zip(COLOURS, rows.items()):
        def column(name, found=found):
            return [row[name] for row in found]
        panels[0].scatter(column("lateral_m"), column("speed_mps"), s=12, color=colour, alpha=0.7, label=label)
        panels[1].scatter(column("attitude_deg"), column("rate_dps"), s=12, color=colour, alpha=0.7)
        panels[2].scatter(column("los_max_deg"), column("clearance_min_m"), s=12, color=colour, alpha=0.7)
    panels[0].set(title="At contact", xlabel="lateral distance [m]", ylabel="speed [m/s]", xscale="log", yscale="log")
    panels[0].axvline(0.5, color="k", ls="--", lw=1.0)
    panels[0].axhline(0.1, color="k", ls="--", lw=1.0)
    panels[1].set(title="At contact", xlabel="attitude error [deg]", ylabel="rate [deg/s]", xscale="log", yscale="log")
    panels[1].axvline(3.0, color="k", ls="--", lw=1.0)
    panels[1].axhline(0.2, color="k", ls="--", lw=1.0)
    panels[2].set(title="On the way", xlabel="largest line-of-sight angle [deg]", ylabel="smallest clearance [m]")
    panels[2].axvline(30.0, color="k", ls="--", lw=1.0)
    panels[2].axhline(0.0, color="k", ls="--", lw=1.0)
    style.legend(panels[0])
    for panel in panels:
        panel.grid(alpha=0.25)
        panel.xaxis.set_minor_formatter("")
    return style.save(figure, path)


BESIDE = {  # title -> what is set in the nominal scenario, or another one
    "both terms": ("lander_nominal", {}),
    "no terrain term": ("lander_nominal", {"controller.terrain_gain": 0.0}),
    "no view term": ("lander_nominal", {"controller.view_gain": 0.0}),
    "PD law": ("lander_pd", {}),
}


def constraints(flown: dict, path) -> Path:
    """What each term of the potential is for. flown: title -> (scenario, signals), the first with both terms."""
    figure = style.new_figure(13.0, 8.0)
    panels = figure.subplots(2, 2)
    side, clearance, view, fall = panels.ravel()
    for (label, (scenario, signals)), colour in zip(flown.items(), (*COLOURS, "#d68910")):
        t, truth = flight(scenario, signals, "lander/truth")
        x, y, z = truth["site_position"].T
        values, distance = scenario.graph.nodes["plant"].values, np.linalg.norm(truth["site_position"], axis=1)
        angle = np.where(distance > values["view_range"], np.degrees(truth["view_angle"]), np.nan)
        width = 1.5
        if label == "both terms":
            width = 4.0
            side.fill_between(np.hypot(x, y), keep_out(values, x, y), color="#c9b79c", alpha=0.6,
                              label="keep-out, below the first")
            draw_fall(fall, scenario, signals)
        side.plot(np.hypot(x, y), z, color=colour, lw=width, label=label)
        clearance.plot(t, truth["clearance"], color=colour, lw=width)
        view.plot(t, angle, color=colour, lw=width)
    side.set(title="Way to the site, from the side", xlabel="horizontal distance [m]", ylabel="z [m]")
    clearance.set(title="Clearance d over the keep-out funnel", xlabel="time [s]", ylabel="d [m]")
    view.set(title="Line of sight, |r| > 5 m", xlabel="time [s]", ylabel="angle [deg]")
    clearance.axhline(0.0, color="k", ls="--", lw=1.0)
    view.axhline(30.0, color="k", ls="--", lw=1.0)
    style.legend(side)
    for panel in panels.ravel():
        panel.grid(alpha=0.25)
    return style.save(figure, path)


def draw_fall(panel, scenario, signals):
    """L of the true motion, written a second time, and L_0 less what the damping has taken."""
    t, truth = flight(scenario, signals, "lander/truth")
    law = scenario.graph.nodes["controller"].values
    v, w = truth["site_velocity"], truth["rates"]
    level = energy.lyapunov(law, truth["mass"], truth["site_position"], v, truth["attitude"], w)
    power = energy.dissipated(law, v, w)
    taken = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(t) * (power[1:] + power[:-1]))])
    panel.plot(t, level, color=COLOURS[0], lw=3.0, alpha=0.5, label="L along the true motion")
    panel.plot(t, level[0] - taken, color="k", ls="--", lw=1.0, label="L(0) less what the damping takes")
    panel.set(title="Lyapunov function, both terms", xlabel="time [s]", ylabel="J")
    style.legend(panel)


def draw(folder, progress=None, kept=None) -> list[Path]:
    """All figures of the paper's runs, into a folder; returns the files. progress(done, total, name).

    kept(scenario) gives the signals of a run from its bag (`flight_graph.claims.kept_runs`).
    """
    from flight_graph.campaigns.cases import Cases
    from flight_graph.graphs.scenario import load
    from flight_graph.runs import simulate
    names = ["lander_nominal", "lander_unconstrained", "lander_pd", "lander_estimated", "lander_bennu"]
    drawn, made = [], kept or simulate
    for number, name in enumerate(names):
        scenario = load(name)
        drawn.append(overview(scenario, made(scenario), Path(folder) / f"{name}.png"))
        if progress:
            progress(number + 1, len(names) + 2, name)
    loaded = {title: load(name, changes) for title, (name, changes) in BESIDE.items()}
    drawn.append(constraints({title: (one, made(one)) for title, one in loaded.items()},
                             Path(folder) / "lander_constraints.png"))
    if progress:
        progress(len(names) + 1, len(names) + 2, "lander_constraints")
    rows = {}
    for label, name in (("perfect", "lander_monte_carlo"), ("perturbed", "lander_monte_carlo_perturbed")):
        cases = Cases(load(name))
        rows[label] = [row.metrics for row in cases.rows(range(cases.vary.count))]
    drawn.append(scatter(rows, Path(folder) / "lander_monte_carlo.png"))
    if progress:
        progress(len(names) + 2, len(names) + 2, "lander_monte_carlo")
    return drawn
