"""The figures 5 to 46 of the Cubli paper: number, curves, axes, and what to look at.

Source: Aerospace 2022, 9(11), 728, captions and section 5.
"""

from dataclasses import dataclass

EARTH = {"": {"scenario": "cubli_earth_paper"}}
ASTEROID = {"": {"scenario": "cubli_asteroid_paper"}}
GAINS = {f"case {n}": {"scenario": "cubli_gains", "case": f"case {n}"} for n in (1, 2, 3)}
BOUNDS = {f"case {n}": {"scenario": "cubli_boundaries", "case": f"case {n}"} for n in (1, 2, 3)}
LAWS = {"APPC": {"scenario": "cubli_controllers", "case": "APPC"},
        "backstepping": {"scenario": "cubli_controllers", "case": "BS 1/2"},
        "PD": {"scenario": "cubli_controllers", "case": "PD 1/1"}}
ANGLE, RATE, ERROR, TORQUE, EFFORT, FEASIBILITY = "angle", "rate", "error", "torque", "effort", "feasibility"
ANGLE_NAMES = ("roll angle phi", "yaw angle theta", "pitch angle psi")
RATE_NAMES = ("roll rate omega_x", "yaw rate omega_y", "pitch rate omega_z")
ERROR_NAMES = ("error e_omega_x", "error e_omega_y", "error e_omega_z")
TORQUE_NAMES = ("control input u_x", "control input u_y", "control input u_z")
NAMES = {ANGLE: ANGLE_NAMES, RATE: RATE_NAMES, ERROR: ERROR_NAMES, TORQUE: TORQUE_NAMES}


@dataclass(frozen=True)
class FigureEntry:
    """One figure. runs: label -> run (as in the claims); quantity and axis (0, 1, 2) say which curve of it."""

    number: int
    title: str
    look: str
    runs: dict
    quantity: str
    axis: int = 0
    seconds: float | None = None


LOOK = {
    (ANGLE, "Earth"): "inside the funnel (dashed); zero after 1.5 s",
    (RATE, "Earth"): "a first swing to 0.6 rad/s at most; eq. (9) allows 8.3 rad/s",
    (ERROR, "Earth"): "inside the funnel (dashed), though of all axes up to 0.997 of it is used (at 0.1 s)",
    (TORQUE, "Earth"): "up to 1.35 N m on the worst axis: more than a small flywheel motor gives",
    (ANGLE, "the asteroid"): "inside the funnel (dashed); settled after 7.4 s, with a ripple of 3e-4 rad left",
    (RATE, "the asteroid"): "each axis below eq. (9) (dotted); the norm of all three is not, see Fig. 44",
    (ERROR, "the asteroid"): "inside the funnel (dashed); of all axes 0.870 of it at most, at the start",
    (TORQUE, "the asteroid"): "below 2e-3 N m, in the first second; then the disturbance's own sine, which stays",
}


def _three(first, quantity, runs, place):
    return [FigureEntry(first + axis, f"{NAMES[quantity][axis].capitalize()} on {place}", LOOK[quantity, place], runs,
                        quantity, axis) for axis in range(3)]


def _four(first, runs, suffix, looks):
    kinds = (ANGLE, RATE, ERROR, TORQUE)
    return [FigureEntry(first + n, f"{NAMES[kind][0].capitalize()} under {suffix}", looks[n], runs, kind, 0, 30.0)
            for n, kind in enumerate(kinds)]


FIGURES = [
    *_three(5, ANGLE, EARTH, "Earth"), *_three(8, RATE, EARTH, "Earth"),
    *_three(11, ERROR, EARTH, "Earth"), *_three(14, TORQUE, EARTH, "Earth"),
    *_three(17, ANGLE, ASTEROID, "the asteroid"), *_three(20, RATE, ASTEROID, "the asteroid"),
    *_three(23, ERROR, ASTEROID, "the asteroid"), *_three(26, TORQUE, ASTEROID, "the asteroid"),
    *_four(29, GAINS, "different control parameters", (
        "larger lambda is faster (case 3), smaller slower (case 2); the overshoot does not grow with it",
        "all three below eq. (9) (dotted): the funnel, not the gains, sets the rate",
        "inside the funnel (dashed); another axis of case 3 starts at 0.976 of it, and lambda = 0.05 cannot start",
        "much the same here; another axis of case 3 starts with 6.5 times the torque of case 1")),
    *_four(33, BOUNDS, "different boundary performance functions", (
        "wider funnels (case 2) overshoot and settle late; faster ones (case 3) settle first",
        "the price of faster funnels is rate; on the worst axis 0.98 of eq. (9) (dotted)",
        "each error inside its own funnel (dashed)",
        "wider funnels ask for more torque, later")),
    *[FigureEntry(number, f"{NAMES[kind][axis].capitalize()} under different control methods", look, LAWS, kind, axis,
                  30.0)
      for number, kind, axis, look in (
          (37, ANGLE, 0, "backstepping fastest, PD oscillates; gains of both are not in the paper"),
          (38, RATE, 0, "backstepping exceeds eq. (9) (dotted), APPC does not"),
          (39, ANGLE, 1, "PD overshoots, APPC least"), (40, RATE, 1, "backstepping exceeds eq. (9) (dotted)"),
          (41, ANGLE, 2, "PD overshoots, APPC least"), (42, RATE, 2, "backstepping exceeds eq. (9) (dotted)"))],
    FigureEntry(43, "Control effort under different methods", "APPC least with these gains; other PD gains spend less",
                LAWS, EFFORT),
    *[FigureEntry(number, f"{name} feasibility analysis", look, {name: LAWS[key]}, FEASIBILITY, 0, 20.0)
      for number, name, key, look in (
          (44, "APPC", "APPC", "each axis below eq. (9), the norm above it for 1.5 s; the ground would have to pull"),
          (45, "Backstepping", "backstepping", "twice eq. (9) per axis; the ground would have to pull with 10 m g"),
          (46, "PD", "PD", "1.4 times eq. (9) per axis; the ground would have to pull with 5 m g"))],
]
GALLERY = [(f"fig_{entry.number:02d}.png", f"Fig. {entry.number}. {entry.title}: {entry.look}", (entry.number,), ())
           for entry in FIGURES]  # file, caption, numbers in the paper, rows of claims that are judged on it besides
