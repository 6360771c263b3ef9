"""A design in closed loop: paper or physical plant, ideal state. The ground lets the corner slide and the rover fly."""

from cubli_ros.design import design
from cubli_ros.design_site import PHASINGS, Rover, Site
from flight_graph.engines.compiled import CompiledRun
from flight_graph.graphs import metrics
from flight_graph.graphs.scenario import Scenario

PLANTS = {"paper": "sim_nodes/cubli_plant", "physical": "sim_nodes/cubli_physical_plant"}


def run(made, site, rover, rate_hz=None, azimuth=0.0, **changed):
    """Metrics of a run of a Design over one and a half times its expected settling time."""
    rate = rate_hz or made.rate_hz
    truth = {"gravity": site.gravity, "initial_angles": list(rover.start), "disturbance_amplitude": site.disturbance,
             "disturbance_frequency": site.frequency, "disturbance_phase": list(PHASINGS[site.phasing]),
             "largest_step": 0.02}
    if rover.model == "physical":
        truth |= {"friction": site.friction, "tilt": site.tilt, "azimuth": azimuth, "on_slip": "slide"}
    scenario = Scenario({
        "name": "design", "title": "a design", "duration_s": round(1.5 * made.settling_s),
        "components": {
            "plant": {"use": PLANTS[rover.model], "rate_hz": max(rate, 50.0), "parameters": truth},
            "controller": {"use": "cubli_ros/appc_controller", "rate_hz": rate,
                           "parameters": {**made.parameters, **changed}}},
        "connect": {"controller.attitude": "plant.attitude"}, "metrics": "papers.appc.metrics:compute"}, "design")
    found = metrics.compute(scenario, CompiledRun(scenario).run())
    return found | {"rate_share": found["rate_across_max"] / found["limit_3d"]}


def designed(rule, model, gravity, ratio, phasing, friction=0.5, **changed):
    """Design and metrics for a disturbance of ratio times gravity [1/m]."""
    site, rover = Site(gravity, 0.0, friction, ratio * gravity, phasing), Rover(model=model)
    made = design(rule, site, rover)
    return made, run(made, site, rover, **changed)
