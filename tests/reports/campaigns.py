"""A campaign of the toy graph, made in a moment."""

from dataclasses import replace

from flight_graph.campaigns import opening
from flight_graph.campaigns.coordinator import folder_of
from flight_graph.campaigns.folder import Campaign
from flight_graph.campaigns.manifest import Manifest
from flight_graph.campaigns.workers import Threads
from flight_graph.graphs.scenario import Scenario
from tests.graph import toy

VARY = {"random": {"plant.angle": {"uniform": [-0.5, 0.5], "size": 3}, "plant.inertia": {"uniform": [1.8, 2.2]}}, "runs": 40,
        "seed": 3}


def made(folder, name="toy", vary=VARY, metrics="tests.requirements.swing_metrics:compute", **changes) -> Campaign:
    """A campaign that has been run. changes: of the scenario."""
    data = {**toy.scenario(metrics=metrics, duration_s=2.0), "name": name, "vary": vary, **changes}
    scenario = Scenario(data, "toy.yaml")
    manifest = replace(Manifest.of(scenario, None, 10), origin="toy.yaml")
    manifest.save(folder_of(folder))
    return opening.fill(Campaign(folder, manifest), scenario, lambda manifest, loaded: Threads(manifest, loaded, 2))
