"""flight list, run, node: what there is, and running it."""

import glob
import json
import os
import signal
from pathlib import Path
from typing import Annotated

import typer

from flight_graph.cli.overview import show_all
from flight_graph.cli.scenario_tables import show
from flight_graph.cli.show import RunProgress, console, metrics_table, report_next, status, steps, warn_of
from flight_graph.cli.topic_tables import show_topics
from flight_graph.cli.trust import Trust, asked
from flight_graph.cli.watched import watched
from flight_graph.errors import FlightError

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output.")]
Settings = Annotated[list[str] | None, typer.Option(
    "--set", metavar="COMPONENT.PARAM=VALUE", help="Change a parameter or a rate; may be repeated.")]
Params = Annotated[list[Path] | None, typer.Option(
    "--params", metavar="FILE", help="A ROS parameter file, such as flight design writes; --set comes on top.")]
CheckBounds = Annotated[bool, typer.Option(
    "--check-bounds", help="Stop at an index beyond an array's end, with its line (slower; compiled apart).")]


def prepare_engine(engine: str) -> None:
    """The python engine runs the same source without its compiler, which has to know before it is imported."""
    if engine == "python":
        os.environ["NUMBA_DISABLE_JIT"] = "1"


def register(app: typer.Typer) -> None:
    app.command("list", epilog="Example: flight list cubli_asteroid --topics")(list_)
    app.command(epilog="Example: flight run cubli_asteroid --engine ros --set controller.lambda_a=0.03 --json")(run)
    app.command(epilog="Example: flight node cubli_ros appc_controller --ros-args -p lambda_a:=0.041", context_settings={
        "allow_extra_args": True, "ignore_unknown_options": True, "help_option_names": []})(node)


def list_(
    scenario: Annotated[str | None, typer.Argument(help="A scenario to look into.")] = None,
    topics: Annotated[bool, typer.Option(
        "--topics", help="Its topics, and the place of every named number in them, as viewers count.")] = False,
    components: Annotated[bool, typer.Option("--components", help="The components, in place of the scenarios.")] = False,
    trust: Trust = False,
    as_json: Json = False,
) -> None:
    """List scenarios by vehicle and purpose, or components; or show one: rates, topics, connections, parameters."""
    if scenario and topics:
        show_topics(scenario, asked(trust), as_json)
        return
    if scenario:
        show(scenario, trust, as_json)
        return
    if topics:
        raise FlightError("flight list --topics: name a scenario")
    show_all(components, as_json)


def run(
    scenario: Annotated[str | None, typer.Argument(
        help="A scenario's name, or the path of a YAML file; or the folder of a campaign, with --case.")] = None,
    begin: Annotated[str | None, typer.Option(
        "--from", metavar="BAG@SECONDS", help="Go on where a recorded run stood at this time; with --set it is a branch "
                                              "of it, and --duration counts from there.")] = None,
    engine: Annotated[str, typer.Option(help="compiled, python (the same kernels, uncompiled) or ros.")] = "compiled",
    pace: Annotated[str, typer.Option(help="ros only: lockstep, realtime or realtime:FACTOR.")] = "lockstep",
    control: Annotated[bool, typer.Option(
        "--control", help="ros only: wait at the start, to be let go, paused, stepped and taken back by the services of "
                          "the node 'simulation' (docs/simulation_control.md).")] = False,
    live: Annotated[bool, typer.Option(
        "--live", help="Show it in Rerun while it runs: in a window, or without a display as a page. In process it keeps "
                       "the wall's pace then, or that of --pace realtime:FACTOR.")] = False,
    settings: Settings = None,
    params: Params = None,
    case: Annotated[int | None, typer.Option(help="Run this case of the scenario's 'vary' block.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of all noise.")] = None,
    duration: Annotated[float | None, typer.Option(help="Simulated seconds.")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder of the bag (a new one).")] = None,
    check_bounds: CheckBounds = False,
    trust: Trust = False,
    as_json: Json = False,
) -> None:
    """Run a scenario, record it to a bag, and print its metrics."""
    prepare_engine(engine)
    from flight_graph import runs
    from flight_graph.engines.choice import check_engine, parse_pace
    from flight_graph.graphs import scenario as scenarios
    consent, campaign, start, swept = asked(trust), None, None, None
    if (scenario is None) == (begin is None):
        raise FlightError("flight run needs a scenario, or --from BAG@SECONDS in its place"
                          + ("; not both" if scenario else ""))
    if begin is not None:
        start = _continued(begin, settings, seed, duration, consent, not as_json, params or case is not None)
        loaded = start.scenario
    elif os.path.isdir(scenario):
        campaign, swept = _campaign(scenario, case, {"--set": settings, "--params": params, "--seed": seed,
                                                     "--duration": duration}, consent)
        loaded = scenarios.vary_case(swept, case)
    else:
        given = overrides(scenario, settings, params, seed, duration, consent)
        loaded = scenarios.load(scenario, given, case, consent)
        swept = None if case is None else scenarios.load(scenario, given, None, consent)
    check_engine(loaded, engine)
    parse_pace(pace)
    folder = runs.new_folder(out, loaded, engine)
    if case is not None:
        status(_case(swept, case))
    for warning in [*loaded.warnings(), *(start.warnings if start else ())]:
        status(f"warning: {warning}")
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # both end the nodes and close the bag
    with watched(loaded, live) as stream, RunProgress(loaded, not as_json) as progress:
        try:
            outcome = runs.execute(loaded, engine, pace, folder, progress.advance, progress.compiling,
                                   check_bounds, tell=status, begin=start.begin if start else None, controlled=control,
                                   live=stream)
        except (KeyboardInterrupt, FlightError) as error:
            reason = str(error) or "interrupted"
            raise FlightError(f"{reason}; {_what_is_left(folder)}") from None
    differing = None if campaign is None else campaign.differences(case, outcome.metrics)
    for sentence in differing or []:
        status(f"warning: {sentence}")
    if as_json:
        print(json.dumps({
            "scenario": loaded.name, "bag": str(outcome.bag), "engine": outcome.engine, "pace": outcome.pace,
            "seed": loaded.seed, "wall_s": outcome.wall_s, "compile_s": outcome.compile_s, "lost": outcome.lost,
            "ros_domain_id": outcome.domain, "begins": start.begin.metadata() if start else None,
            "metrics": outcome.metrics, "units": _units(loaded, outcome.metrics),
            "statistics": outcome.statistics, "watchdog": outcome.notes,
            "earlier_bags": [str(bag) for bag in outcome.earlier], "was_ended": outcome.was_ended,
            "warnings": loaded.warnings(), "alarms": outcome.alarms, "differs_from_its_row": differing}))
        return
    if start:
        status(start.begin.sentence())
    if outcome.was_ended:
        status("the run was ended by who controls it; its bag is whole up to there, and metrics are of whole runs")
    else:
        console.print(metrics_table(loaded, outcome))
    for note in outcome.notes:
        status(note)
    if outcome.lost:
        status(f"{outcome.lost} messages were lost (realtime); the bag's metadata says which")
    print(outcome.bag, flush=True)
    warn_of(outcome.alarms)
    report_next(outcome.bag)


def _continued(begin, settings, seed, duration, consent, wanted, others):
    """What goes on where a recorded run stood."""
    from flight_graph.graphs.overrides import parse_settings
    from flight_graph.recordings.continuation import continued
    if others:
        raise FlightError("--params and --case are of a scenario's file; with --from, --set says what a branch changes")
    given = parse_settings(settings) | ({"seed": seed} if seed is not None else {})
    with steps(f"to {begin}", wanted) as advance:
        return continued(begin, given, duration, consent, lambda seconds, total: advance(seconds, total, "s simulated"),
                         lambda done, total, names: advance(done, total, f"compiling {names} (once; it is kept)"))


def _units(scenario, metrics) -> dict:
    """The units of metrics that have one."""
    from flight_graph.graphs import glossary
    known = glossary.of(scenario)
    return {name: known.entry(name).unit for name in metrics if known.entry(name).unit}


def _campaign(folder, case, given, consent):
    """The campaign in a folder and its scenario, for a run of one of its cases."""
    from flight_graph.campaigns import opening
    if case is None:
        raise FlightError(f"{folder} is the folder of a campaign: --case says which of its runs is meant")
    opening.refuse_what_is_fixed(given)
    return opening.existing(Path(folder), None, consent)


def _case(scenario, number) -> str:
    """A case of a sweep in words."""
    vary = scenario.vary
    name, values = vary.name(number), {key: value for key, value in vary.overrides(number).items() if value is not None}
    return f"case {number}: {name + '; ' if name else ''}{', '.join(f'{key} {value}' for key, value in values.items())}"


def _what_is_left(folder) -> str:
    from flight_graph.bags.errors import quoted
    segments = [folder, *folder.parent.glob(f"{glob.escape(folder.name)}_reset_*")]  # of a run that was taken back
    folder = max((path for path in segments if path.exists()), key=lambda path: path.stat().st_mtime, default=folder)
    if (folder / "metadata.yaml").exists():
        return f"the bag up to here is {quoted(folder)}"
    if any(folder.glob("*.mcap")):
        return f"the bag was not closed: `flight recover {quoted(folder)}` saves what is in it"
    return "nothing was recorded"


def node(
    context: typer.Context,
    package: Annotated[str, typer.Argument(
        help="cubli_ros, sim_nodes, ...; or 'package/executable', 'file.py:Class', either with '@namespace', for both.")],
) -> None:
    """Run one node, as ros2 run would: flight node PACKAGE EXECUTABLE [ROS ARGS]."""
    from flight_graph.ros.entry import main, run_component
    if package in ("-h", "--help"):
        print(context.command.get_help(context))
        return
    arguments = list(context.args)
    if set(":@") & set(package) or package.endswith(".py"):
        plain = package.partition("@")[0]
        raise typer.Exit(run_component(package, (plain.rpartition(":")[2] or plain).rpartition("/")[2].lower(), arguments))
    if "/" in package:  # as scenarios write it
        package, _, executable = package.partition("/")
        arguments.insert(0, executable)
    if not arguments or arguments[0] in ("-h", "--help"):
        from flight_graph.components import registry
        print(f"executables of {package}: {', '.join(registry.executables(package))}")
        raise typer.Exit(0 if arguments else 2)
    raise typer.Exit(main(package, arguments[0], arguments[1:]))


def overrides(scenario, settings, params=None, seed=None, duration=None, consent=None) -> dict:
    """What the options of a command set in a scenario, by key. consent: as for `scenario.load`; None: to everything."""
    from flight_graph.graphs import overrides as given
    return given.overrides(scenario, settings, params, seed, duration, consent, tell=status)
