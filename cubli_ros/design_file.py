"""A design of the rover as a ROS parameter file: for the nodes' --params-file and for flight run --params."""

import yaml

from cubli_ros.design import Design, design  # noqa: F401 (what flight design needs, in one place)
from cubli_ros.design_site import PHASINGS, Rover, Site

SCENARIO = "cubli_asteroid"  # that a design is flown in


class _Dumper(yaml.SafeDumper):
    """Without anchors, which the readers of ROS parameter files do not know."""

    def ignore_aliases(self, data):
        return True


def parameter_file(made: Design, site: Site, rover: Rover) -> str:
    """The design as a ROS parameter file, with the argument as its comments."""
    lines = [f"# Cubli rover, design rule {made.rule}: g = {site.gravity:g} m/s^2, ground tilt {site.tilt:g} rad, "
             f"friction {site.friction:g},", f"# disturbance {site.disturbance:g} rad/s^2 at {site.frequency:g} rad/s, "
             f"axes {site.phasing}, {rover.model} inertia."]
    lines += [f"# {sentence}" for sentence in made.argument]
    lines += [f"# {name}: {value:.4g}" for name, value in facts(made).items()]
    lines += [f"# WARNING: {sentence}" for sentence in made.warnings]
    controller = {"rate_hz": made.rate_hz, **made.parameters}
    inertia = made.parameters["inertia"]
    monitor = {"gravity": float(site.gravity), "friction": float(site.friction), "tilt": float(site.tilt),
               "inertia": inertia}
    truth = {"gravity": float(site.gravity), "initial_angles": [float(angle) for angle in rover.start],
             "disturbance_amplitude": [float(site.disturbance)] * 3, "disturbance_frequency": float(site.frequency),
             "disturbance_phase": list(PHASINGS[site.phasing])}
    ground = {"friction": float(site.friction), "tilt": float(site.tilt)}
    sections = {"/**/controller": controller, "/**/appc_controller": controller, "/**/monitor": monitor,
                "/**/jump_monitor": monitor, "/**/plant": truth, "/**/cubli_physical_plant": ground}
    for name, values in sections.items():
        if name == "/**/plant":
            lines.append("# the case that the design is for, as a simulation has it")
        lines.append(yaml.dump({name: {"ros__parameters": values}}, Dumper=_Dumper, sort_keys=False,
                               default_flow_style=None, width=110).rstrip())
    return "\n".join(lines) + "\n"


def facts(made: Design) -> dict:
    """Numbers of a design by name, for a person."""
    return {"control rate [Hz]": made.rate_hz, "minimum control rate [Hz]": made.minimum_rate_hz,
            "expected settling [s]": made.settling_s, **made.margins}
