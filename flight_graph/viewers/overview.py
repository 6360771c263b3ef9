"""What is looked at first of a vehicle: the plots that its package names in ``plots.yaml``, for every viewer's layout.

    - {title: attitude error inside its funnel, show: [/cubli/funnel.attitude_error, /cubli/funnel.attitude_bound]}

Each entry of ``show`` is TOPIC.SERIES. An entry is left out where the run has not got the topic.
"""

from dataclasses import dataclass
from importlib import resources

from flight_graph import yaml_text
from flight_graph.bags.series import Series
from flight_graph.components import registry
from flight_graph.errors import FlightError
from flight_graph.viewers.opening import MOST_LINES

FILE = "plots.yaml"
MOST_PLOTS = 6  # beside the picture


@dataclass(frozen=True)
class Plot:
    """Some series in one plot."""

    title: str
    series: tuple[Series, ...]

    @property
    def full_title(self) -> str:
        """With the unit, where all of its series have the same."""
        units = {one.unit for one in self.series}
        return f"{self.title} [{units.pop()}]" if len(units) == 1 and "" not in units else self.title


def overview(series: list[Series]) -> list[Plot]:
    """The plots that are shown beside the picture: those that the vehicles' packages name, else one for each topic."""
    known = {one.key: one for one in series}
    found = []
    for title, keys in _named():
        if mine := tuple(known[key] for key in keys if key in known):
            found.append(Plot(title, mine))
    if not found:
        first = {}
        for one in series:
            first.setdefault(one.topic, one)
        found = [Plot(f"{one.topic}  {one.name}", (one,)) for one in first.values()]
    return found[:MOST_PLOTS]


def by_topic(series: list[Series]) -> dict[str, list[Plot]]:
    """topic -> the plots of its series: those of one unit share a plot, as long as it can be read."""
    topics, found = {}, {}
    for one in series:
        plots = topics.setdefault(one.topic, [])
        shared = next((plot for plot in plots if plot[0].unit == one.unit
                       and sum(len(other.lines) for other in plot) + len(one.lines) <= MOST_LINES), None)
        if shared is None:
            plots.append([one])
        else:
            shared.append(one)
    for topic, plots in topics.items():
        found[topic] = [Plot(", ".join(one.name for one in plot[:3]) + (", ..." if len(plot) > 3 else ""), tuple(plot))
                        for plot in plots]
    return found


def _named():
    """Yield (title, keys of series) of all packages."""
    for package in registry.PACKAGES:
        file = resources.files(package) / FILE
        if file.is_file():
            for entry in yaml_text.parse(file.read_text(encoding="utf-8"), f"{package}/{FILE}"):
                if not isinstance(entry, dict) or entry.keys() != {"title", "show"}:
                    raise FlightError(f"{package}/{FILE}: an entry is {{title: ..., show: [TOPIC.SERIES, ...]}}")
                yield entry["title"], entry["show"]
