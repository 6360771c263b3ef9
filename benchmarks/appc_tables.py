"""The tables of numbers behind the Cubli paper's claims, beside those of an independent implementation.

    python benchmarks/appc_tables.py [--only SECTION]

Each value is run again and printed as `found (reference)`. A value that differs from its reference by more than 3 % is
marked *, and the lines under a table say why. The references were made with Radau, LSODA and RK4 on other code; where
they are a bound or a verdict ("x": diverges or never settles), the verdict is compared.
"""

import argparse

from flight_graph.claims.claim_runs import RunEntry, run_all

TOLERANCE = 0.03  # relative
FLOOR = {"tail_rad": 1e-5, "normal_force_min": 0.01, "overshoot_percent": 0.05}  # differences that mean nothing
COLUMNS = {"xi_a": "xi_a_max", "xi_u": "xi_u_max", "ts": "settling_time_s", "os %": "overshoot_percent",
           "tail": "tail_rad", "w_i": "rate_axis_max", "|w|/w9": "rate_norm_max", "across/w3": "rate_across_max",
           "peak u": "torque_peak", "E": "effort", "N min": "normal_force_min", "Om": "wheel_speed_max"}
PAPER = {"scenario": "cubli_asteroid_paper"}


def _gains(case):
    return {"scenario": "cubli_gains", "case": case}


def _bounds(case):
    return {"scenario": "cubli_boundaries", "case": case}


def _slowed(factor):
    """As long as the slowed run needs to show what 60 s show of the other."""
    duration = round(60.0 / factor)  # [s]
    return {"scenario": "cubli_boundaries", "case": f"slowed by {factor:.2f}", "set": {"duration_s": duration}}


def _law(case):
    return {"scenario": "cubli_controllers", "case": case}


def _disturbed(number):
    return {"scenario": "cubli_disturbances", "case": number}


def _physical(**changes):
    settings = {"plant.on_lift_off": "hold", **{key.replace("__", "."): value for key, value in changes.items()}}
    return {"scenario": "cubli_physical", "set": settings}


def _earth(**changes):
    table_1 = {"rho_a0": 0.5, "l_a": -2.0, "lambda_a": 0.55, "rho_u0": 0.9, "rho_u_inf": 0.08, "l_u": -2.0,
               "lambda_u": 0.55, "eta_u": 0.0053, "gravity": 9.8, "torque_limit": 1e4, "rate_hz": 1000}
    plant = {"gravity": 9.8, "disturbance_amplitude": 0.0, "torque_limit": 1e4, "speed_limit": 1e9, "rate_hz": 1000}
    run = _physical(**changes)
    run["set"].update({f"controller.{key}": value for key, value in table_1.items()}, duration_s=6.0)
    run["set"].update({f"plant.{key}": value for key, value in plant.items()})
    return run


def _long(smoothing):
    return {**PAPER, "set": {"duration_s": 1000, "plant.rate_hz": 100, "controller.rate_hz": 100,
                             "controller.smoothing": smoothing}}


SCALAR = [0.0133333333, 0, 0, 0, 0.0133333333, 0, 0, 0, 0.0133333333]
ACROSS = [0.0733333333, 0, 0, 0, 0.0733333333, 0, 0, 0, 0.0733333333]
RATES = (20, 50, 80, 100, 200, 500, 1000, 2000, 5000, 10000, 20000)

# section -> (columns, rows: name -> (run, reference values), remarks)
TABLES = {
    "continuous time": (("xi_a", "xi_u", "ts", "os %", "tail", "w_i", "|w|/w9", "peak u", "E", "N min"), {
        "Earth": ({"scenario": "cubli_earth_paper"},
                  (.829597, .997286, 1.460, .05, 1e-9, .60422, .106, 1.34936, .894143, .156)),
        "asteroid, 0.1 rad/s": (_disturbed(0),
            (.8802, .8699, 8.442, 2.05, 2.9e-4, .1031, 1.209, 1.955e-3, 1.182e-5, -.80)),
        "asteroid, 0.5 rad/s": (_disturbed(1),
            (.8807, .8699, 7.347, 1.51, 2.9e-4, .1004, 1.188, 1.955e-3, 1.169e-5, -.79)),
        "asteroid, 1 rad/s": (PAPER,
            (.881184, .869897, 7.431, 1.37, 2.9e-4, .098627, 1.175, 1.9547e-3, 1.24218e-5, -.81)),
        "asteroid, 2 rad/s": (_disturbed(3),
            (.8816, .8699, 7.131, .85, 2.9e-4, .1005, 1.193, 1.955e-3, 1.309e-5, -.82)),
        "asteroid, no disturbance": (
            {"scenario": "cubli_gains", "case": "case 1", "set": {"plant.disturbance_amplitude": 0.0}},
            (.8801, .8699, 6.748, .07, 0.0, .1040, 1.216, 1.955e-3, 5.324e-6, -.82)),
    }, ["Tail at 0.1 rad/s: the last sixth of 60 s does not hold a whole period (63 s) of the disturbance."]),
    "slowed by kappa": (("|w|/w9", "across/w3", "N min", "xi_a", "xi_u", "ts", "E", "tail"), {
        "0.85": (_slowed(0.85), (.981, 1.008, -.289, .8823, .8715, 9.68, 1.21e-5, 3.7e-4)),
        "0.80": (_slowed(0.8), (.917, .945, -.138, .8828, .8772, 10.07, 1.22e-5, 4.0e-4)),
        "0.75": (_slowed(0.75), (.854, .882, .002, .8834, .8835, 10.41, 1.24e-5, 4.3e-4)),
        "0.70": (_slowed(0.7), (.792, .820, .129, .8840, .8903, 10.75, 1.27e-5, 4.7e-4)),
        "0.60": (_slowed(0.6), (.671, .696, .340, .8853, .9051, 13.53, 1.39e-5, 5.4e-4)),
        "0.50": (_slowed(0.5), (.609, .569, .501, .8870, .9209, 16.56, 1.56e-5, 6.1e-4)),
    }, ["The runs last 60 s / kappa: the disturbance costs 1.07e-7 N^2 m^2 s per second, whatever kappa."]),
    "baselines": (("ts", "os %", "tail", "w_i", "|w|/w9", "N min", "E", "peak u"), {
        "APPC": (_law("APPC"), (7.431, 1.37, 2.9e-4, .0986, 1.175, -.81, 1.242e-5, 1.955e-3)),
        "PD 1/1": (_law("PD 1/1"), (None, 19.24, 2.01e-2, .1620, 2.220, -4.66, 3.513e-5, 4.00e-3)),
        "BS 1/2": (_law("BS 1/2"), (2.671, 2.01, 5.57e-3, .2485, 2.988, -10.26, 7.938e-5, 1.550e-2)),
        "PD 0.3/1": (_law("PD 0.3/1"), ("", "", 1.6e-2, "", .763, "", 7.16e-6, "")),
        "PD 2/3": (_law("PD 2/3"), (4.59, "", 6.3e-3, "", "", "", "", "")),
        "BS 4/8": (_law("BS 4/8"), ("", .20, 5.9e-4, "", "", "", 1.9e-3, "")),
        "PD 1/1, hanging": (_law("PD 1/1, hanging"), ("", "", "", "", "", "", 3.510e-5, "")),
        "BS 1/2, hanging": (_law("BS 1/2, hanging"), ("", "", "", "", "", "", 7.566e-5, "")),
    }, []),
    "gains and bounds": (("xi_a", "xi_u", "ts", "os %", "tail", "w_i", "|w|/w9", "peak u", "E"), {
        "gains 1": (_gains("case 1"), (.8812, .8699, 7.431, 1.37, 2.89e-4, .0986, 1.175, 1.955e-3, 1.248e-5)),
        "gains 2": (_gains("case 2"), (.9188, .9331, 9.072, 1.41, 5.46e-4, .0985, 1.157, 2.792e-3, 1.380e-5)),
        "gains 3": (_gains("case 3"), (.8651, .9760, 7.250, 1.31, 2.29e-4, .0990, 1.182, 1.261e-2, 1.292e-5)),
        "bounds 2": (_bounds("case 2"), (.9186, .9405, 9.859, 8.25, 8.02e-4, .1111, 1.297, 4.458e-3, 1.789e-5)),
        "bounds 3": (_bounds("case 3"), (.8908, .8977, 6.804, .74, 2.93e-4, .1161, 1.373, 2.529e-3, 1.501e-5)),
        "gains 1, hanging": (_gains("hanging, case 1"), ("", "", 7.261, "", "", "", "", "", 1.101e-5)),
        "gains 2, hanging": (_gains("hanging, case 2"), ("", "", 7.724, "", "", "", "", "", 1.138e-5)),
        "gains 3, hanging": (_gains("hanging, case 3"), ("", "", 7.083, "", "", "", "", "", 1.170e-5)),
        "bounds 2, hanging": (_bounds("hanging, case 2"), ("", "", 9.887, "", "", "", "", "", 1.268e-5)),
        "bounds 3, hanging": (_bounds("hanging, case 3"), ("", "", 6.698, "", "", "", "", "", 1.317e-5)),
    }, ["eta times 100 diverges in the reference at 4.6 s, with a step of 5 ms; at 1 ms it holds (xi_u = 0.990)."]),
    "physical rover": (("xi_a", "xi_u", "ts", "os %", "E", "peak u", "Om", "N min"), {
        "scalar inertia, 100 Hz": (_physical(controller__inertia=SCALAR), ("", "x", None, "", "", "", "", "")),
        "scalar inertia, 1 kHz": (_physical(controller__inertia=SCALAR, plant__rate_hz=1000, controller__rate_hz=1000),
                                  ("", .978, 9.03, 7.8, "", "", "", "")),
        "11/12 m l^2": (_physical(controller__inertia=ACROSS), ("", "", 6.64, .55, 1.22e-4, 1.08e-2, "", "")),
        "full": (_physical(), (.879, .870, 7.40, 1.47, 1.138e-4, 8.2e-3, 7.6, -1.0)),
        "full, implicit, feed-forward": (_physical(controller__law="implicit", controller__feed_forward=1.0),
                                         ("", "", 7.40, "", 1.09e-4, "", "", -1.0)),
        "full, 120 degrees apart": (_physical(plant__disturbance_phase=[0.0, 2.0943951024, 4.1887902048]),
                                    ("", "", 6.64, "", "", "", "", -1.06)),
    }, ["The reference for N min is rounded to -1.0."]),
    "physical rover on Earth, 1 kHz": (("xi_u", "peak u", "Om"), {
        "full": (_earth(), (.992, 2.45, 665.0)),
        "full, implicit, feed-forward": (_earth(controller__law="implicit", controller__feed_forward=1.0),
                                         (1.011, 1.44, 509.0)),
    }, []),
    "adaptation": (("xi_u", "tail", "E"), {
        "k = 0": (_gains("k 0"), ("", 4.0e-4, 1.242e-5)),
        "eta_a x1000": (_gains("eta_a x1000"), ("x", "", "")),
        "eta_a x1000, hard sign": (_gains("eta_a x1000, hard sign"), ("x", "", "")),
        "eta_a x1000, smoothing 0.1": (_gains("eta_a x1000, smoothing 0.1"), ("", "", "")),
        "hard sign, 1000 s at 100 Hz": (_long(0.0), ("", 6.7e-5, "")),
        "smoothing 0.01, 1000 s at 100 Hz": (_long(0.01), ("", "", "")),
    }, ["1000 s: sgn goes on switching below the smoothing's width, so it adapts further (v_u 1.17 against 0.97); its",
        "ripple of the last sixth depends on the sampling (5.9e-5 rad at 1 kHz)."]),
}
# Largest xi_u on Earth at each of RATES; x: diverges, tumbles or never settles; ok: below 1.
SAMPLED = {
    "explicit": (0, ("x", "x", "x", "x", "x", "x", "x", "x", "x", "x", "ok")),
    "explicit, feed-forward": (1, ("x", "x", "ok", .957, .954, "ok", .950, "ok", "ok", "ok", "ok")),
    "implicit": (2, ("stays up", 4.5, "", 2.5, 1.70, 1.27, 1.13, 1.06, 1.023, 1.010, 1.004)),
    "implicit, feed-forward": (3, (1.76, 1.05, "ok", .946, .942, .947, .948, "ok", "ok", "ok", "ok")),
}


def differs(column, found, reference) -> bool:
    """Whether a value is farther from its reference than TOLERANCE and FLOOR allow."""
    if reference == "":
        return False
    if reference == "x":
        return found is not None and found < 1.0
    if found is None or reference is None:
        return found is not reference
    return abs(found - reference) > max(TOLERANCE * abs(reference), FLOOR.get(COLUMNS.get(column), 0.0))


def value(column, found):
    """A metric by its column; ratios are of the rate limits."""
    metric = found.get(COLUMNS[column])
    if metric is None:
        return None
    limit = {"|w|/w9": "limit_eq9", "across/w3": "limit_3d"}.get(column)
    return metric / found[limit] if limit else metric


def text(number) -> str:
    return "none" if number is None else number if isinstance(number, str) else f"{number:.4g}"


def print_table(title, columns, rows, remarks) -> int:
    """Run and print one table; return how many values differ."""
    results = run_all({name: RunEntry(**run) for name, (run, _) in rows.items()}, 2)
    lines, marked = [["", *columns]], 0
    for name, (_, references) in rows.items():
        cells = [name]
        for column, reference in zip(columns, references, strict=True):
            found = value(column, results[name])
            marked += differs(column, found, reference)
            mark = "*" if differs(column, found, reference) else ""
            cells.append(f"{text(found)}{mark}" + (f" ({text(reference)})" if reference != "" else ""))
        lines.append(cells)
    _print(title, lines, remarks)
    return marked


def print_sampled() -> int:
    """The largest xi_u on Earth by form and rate."""
    results = run_all({"rates": RunEntry(scenario="cubli_rates", cases="all")}, 2)["rates"]
    found, marked = list(results.values()), 0
    lines = [["max xi_u", *(f"{rate} Hz" for rate in RATES)]]
    for form, (offset, references) in SAMPLED.items():
        cells = [form]
        for n, reference in enumerate(references):
            one = found[4 * n + offset]
            settled, xi = one.get("settling_time_s") is not None, one.get("xi_u_max")
            if reference == "stays up":
                different = one["overshoot_percent"] > 200.0
            elif reference == "x":
                different = settled and xi < 1.0
            elif reference == "ok":
                different = not (settled and xi < 1.0)
            else:
                different = differs("xi_u", xi, reference)
            marked += different
            cells.append((f"{xi:.4g}" if settled else "x" if reference != "stays up" else "stays up")
                         + ("*" if different else "") + (f" ({text(reference)})" if reference != "" else ""))
        lines.append(cells)
    _print("sampled on Earth", lines, ["80 Hz stands beside the reference's 70 Hz (60 Hz fails there by 0.9 %)."])
    return marked


def _print(title, lines, remarks):
    print(f"\n## {title}: found (reference)\n")
    widths = [max(len(line[n]) for line in lines) for n in range(len(lines[0]))]
    for number, line in enumerate(lines):
        print("| " + " | ".join(cell.ljust(width) for cell, width in zip(line, widths)) + " |")
        if number == 0:
            print("|" + "|".join("-" * (width + 2) for width in widths) + "|")
    for remark in remarks:
        print(remark)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--only", choices=[*TABLES, "sampled on Earth"])
    only = parser.parse_args().only
    marked = 0
    for title, (columns, rows, remarks) in TABLES.items():
        if only in (None, title):
            marked += print_table(title, columns, rows, remarks)
    if only in (None, "sampled on Earth"):
        marked += print_sampled()
    print(f"\n{marked} values differ by more than {100 * TOLERANCE:g} % (*)")


if __name__ == "__main__":
    main()
