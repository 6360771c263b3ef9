"""Figures of the Cubli rover's runs, drawn from recorded signals."""

from pathlib import Path

import numpy as np

from papers.appc.metrics import matched, seconds

AXES = ("x (phi)", "y (theta)", "z (psi)")
COLOURS = ("#0b6e99", "#c0392b", "#2e8b57")


def overview(scenario, signals, path) -> Path:
    """Attitude in its funnel, rates against eq. (9), the rate funnel and the torques, as one PNG."""
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    truth, funnel = signals["cubli/truth"], signals["cubli/funnel"]
    t, t_law = seconds(truth, scenario), seconds(funnel, scenario)
    values = scenario.graph.nodes["plant"].values
    limit = np.sqrt(np.sqrt(2.0) * values["gravity"] / values["length"])
    torque = matched(t, signals["cubli/wheel_command"], scenario)
    figure, panels = pyplot.subplots(2, 2, figsize=(12.0, 8.0), layout="constrained", sharex=True)
    attitude, rates, funnels, torques = panels.ravel()
    for axis in range(3):
        attitude.plot(t, truth["angles"][:, axis], color=COLOURS[axis], label=AXES[axis])
        rates.plot(t, truth["rates"][:, axis], color=COLOURS[axis], lw=0.9)
        funnels.plot(t_law, funnel["rate_xi"][:, axis], color=COLOURS[axis], lw=0.9)
        torques.plot(t, 1e3 * torque[:, axis], color=COLOURS[axis], lw=0.9)
    for sign in (1.0, -1.0):
        attitude.plot(t_law, sign * funnel["attitude_bound"][:, 0], "k--", lw=1.0)
        rates.axhline(sign * limit, color="k", ls="--", lw=1.0)
        funnels.axhline(sign, color="k", ls="--", lw=1.0)
    rates.plot(t, np.linalg.norm(truth["rates"], axis=1), color="0.45", lw=1.4, label="|omega|")
    attitude.set(title="Attitude: inside its funnel (dashed)", ylabel="Cardan angle [rad]")
    rates.set(title="Rates: each axis below eq. (9) (dashed), the norm is not", ylabel="rate [rad/s]")
    funnels.set(title="Rate error over its funnel: |xi_u| < 1", ylabel="xi_u [1]", xlabel="time [s]")
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
