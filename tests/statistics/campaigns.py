"""Campaign folders whose rows are functions of the draws that are written down here, without any simulation."""

import math

from flight_graph.campaigns import chunk, rows
from flight_graph.campaigns.manifest import Manifest
from flight_graph.graphs.vary import Vary

MISS = {"random": {"p.mass": {"normal": [2.0, 0.1]}, "p.wind": {"uniform": [-1.0, 1.0], "size": 2}, "seed": {"count": 1}},
        "runs": 400}


def miss(gain=1.0):
    """Rows of a landing: every 97th run stops; every 50th has no distance; every 70th a speed that is no number."""
    def judged(case, values):
        if case % 97 == 5:
            return "fault", {}
        distance = gain * abs(values["p.mass"] - 2.0) * 10.0 + values["p.wind"][0] ** 2 + 0.2 * values.get("p.g", 0)
        return "ok", {"lateral_m": None if case % 50 == 0 else distance, "landed": distance < 2.0, "bounces": case % 4,
                      "speed": math.nan if case % 70 == 1 else 1.0 + distance, "mode": "safe" if distance > 3.0 else "land"}
    return judged


def write(folder, vary, judged, runs=None, step=64, ended=None):
    """A campaign's folder of this vary block. judged(case, values) -> (status, metrics)."""
    folder.mkdir()
    block = Vary(vary, "toy")
    manifest = Manifest("toy", {}, vary, {}, {}, step, runs or block.count, origin="toy.yaml",
                        combinations=len(block.combinations), ended=ended)
    manifest.save(folder)
    for number in manifest.chunks:
        found = []
        for case in manifest.cases(number):
            values = block.overrides(case)
            status, metrics = judged(case, values)
            shown = {key: value for key, value in values.items() if key != "seed"}
            found.append(rows.Row(case, block.name(case), shown, values.get("seed", 0), status, "", metrics))
        content = chunk.encode(rows.table_of(found, {"lateral_m": "m"}), manifest.identity, number)
        (folder / chunk.part_name(number)).write_bytes(content)
    return folder
