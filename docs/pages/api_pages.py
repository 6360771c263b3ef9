"""The pages of the programming interface: which modules are public, and in what order they are read.

What the handbook and the examples import is here. The text of each page is in the docstrings.
"""

import importlib
import inspect
from importlib.util import find_spec
from pathlib import Path

from pages.errors import PageError
from pages.staging import ROOT, page_of

INDEX = "Python interface"
SECTIONS = {  # page -> its title, what it is for, its modules
    "notebook": ("For a notebook", "Runs, campaigns, pictures and tables by the names of the commands, from one import.", (
        "flight_graph.notebook", "flight_graph.tables")),
    "bags": ("Reading bags", "Any bag as NumPy arrays; a run's bag with its scenario; comparing and exporting.", (
        "flight_graph.bags.reader", "flight_graph.bags.topics", "flight_graph.bags.layout", "flight_graph.bags.errors",
        "flight_graph.bags.diff", "flight_graph.bags.export", "flight_graph.recordings.recording",
        "flight_graph.recordings.recorded_run", "flight_graph.recordings.comparison", "flight_graph.replays.verify")),
    "runs": ("Scenarios and runs", "Load a scenario, run it in any engine, its metrics.", (
        "flight_graph.graphs.scenario", "flight_graph.graphs.source", "flight_graph.runs", "flight_graph.engines.compiled",
        "flight_graph.engines.flight", "flight_graph.engines.checkpoint", "flight_graph.graphs.graph",
        "flight_graph.graphs.metrics", "flight_graph.graphs.glossary", "flight_graph.graphs.metric_entry",
        "flight_graph.errors")),
    "stepping": ("Stepping", "A run in the hands of a program: forward, back, branches.", (
        "flight_graph.stepping.stepper", "flight_graph.stepping.difference")),
    "components": ("Components", "What a component of your own is made of.", (
        "flight_graph.components.component", "flight_graph.components.records", "flight_graph.components.registry",
        "flight_graph.components.foreign", "flight_graph.timebase")),
    "signals": ("Signals", "What travels between components, and the topics of the vehicles.", (
        "msg_schemas.signal", "msg_schemas.qos", "msg_schemas.definitions", "msg_schemas.cubli", "msg_schemas.lander",
        "msg_schemas.spacerobot")),
    "mathematics": ("Mathematics of kernels", "Values, elementary functions, rotations, integrators, noise.", (
        "flight_math", "flight_math.kernel", "flight_math.elementary", "flight_math.rotation", "flight_math.matrices",
        "flight_math.dense", "flight_math.integrators", "flight_math.noise")),
    "campaigns": ("Campaigns and statistics", "Many runs in a folder, read and judged.", (
        "flight_graph.campaigns.opening", "flight_graph.campaigns.folder", "flight_graph.campaigns.manifest",
        "flight_graph.campaigns.cases", "flight_graph.campaigns.report", "flight_graph.campaigns.paired",
        "flight_graph.campaigns.rare_events", "flight_graph.statistics.rates", "flight_graph.statistics.percentiles",
        "flight_graph.statistics.pairs", "flight_graph.statistics.sensitivities", "flight_graph.statistics.stopping",
        "flight_graph.statistics.subset_simulation")),
    "judging": ("Claims and requirements", "Rows of a paper and requirements of a vehicle, recomputed.", (
        "flight_graph.claims.claims", "flight_graph.claims.claims_file", "flight_graph.claims.relation",
        "flight_graph.requirements.requirements_file", "flight_graph.requirements.checking",
        "flight_graph.requirements.evidence")),
    "seeing": ("Scenes and pictures", "What a vehicle looks like, where it is, and numbers over time.", (
        "flight_graph.scenes.scene", "flight_graph.scenes.finding", "flight_graph.scenes.motion",
        "flight_graph.viewers.rerun_stream", "flight_graph.bags.series", "flight_graph.plots.bag_lines")),
}
OPTIONS = {"flight_math": ["   :exclude-members: kernel"], "flight_math.elementary": []}  # what is exported from elsewhere


def write(stage) -> None:
    """The index and a page for each section."""
    lines = [f"# {INDEX}", "", "Public modules by purpose. A kernel's mathematics is told in [values](../values.md), a "
             "component of your own in [extend](../extend.md), reading a bag in [bags](../bags.md#in-a-notebook).", "",
             "| page | for | modules |", "|---|---|---|"]
    lines += [f"| [{title}]({name}.md) | {purpose} | {', '.join(f'`{module}`' for module in modules)} |"
              for name, (title, purpose, modules) in SECTIONS.items()]
    stage.write("api/index.md", "\n".join(lines) + "\n")
    gone = [module for *_, modules in SECTIONS.values() for module in modules if find_spec(module) is None]
    if gone:
        raise PageError(f"docs/pages/api_pages.py names {gone[0]}, which is not there: name the module that has its place")
    for name, (title, purpose, modules) in SECTIONS.items():
        parts = [f"# {title}", "", purpose]
        for module in modules:
            parts += ["", f"## `{module}`", "", f"[source](../../{_file(module)})", "", "```{eval-rst}",
                      f".. automodule:: {module}", "   :members:",
                      *OPTIONS.get(module, ["   :ignore-module-all:"]), "```"]
        stage.write(f"api/{name}.md", "\n".join(parts) + "\n")
    for module in OPTIONS:
        public = importlib.import_module(module)
        stage.wanted |= set(filter(None, (_place(getattr(public, name))[0] for name in public.__all__)))


def _file(module: str) -> str:
    return Path(inspect.getsourcefile(importlib.import_module(module))).relative_to(ROOT).as_posix()


def source_of(module: str, name: str) -> str | None:
    """The link from a page of the interface to the lines of a class, function or method; None where there are none."""
    try:
        thing = importlib.import_module(module)
        for part in name.split("."):
            thing = inspect.getattr_static(thing, part)
    except (ImportError, AttributeError):
        return None
    path, line = _place(thing)
    return f"../{page_of(path)}#L{line}" if path else None


def _place(thing) -> tuple[Path | None, int]:
    """File and line of a class, function or method of this project; None and 0 of anything else."""
    thing = inspect.unwrap(getattr(thing, "py_func", getattr(thing, "fget", getattr(thing, "__func__", thing))))
    try:
        path, line = Path(inspect.getsourcefile(thing)), inspect.getsourcelines(thing)[1]
    except (TypeError, OSError):
        return None, 0
    return (path, line) if path.is_relative_to(ROOT) and "site-packages" not in path.parts else (None, 0)
