"""flight step: a debugger of the graph in the terminal."""

import sys
from typing import Annotated

import typer

from flight_graph.cli.scenarios import CheckBounds, Settings, prepare_engine
from flight_graph.cli.show import console, status, steps
from flight_graph.cli.trust import Trust, asked
from flight_graph.errors import FlightError

HISTORY = ".flight_step_history"  # in the home folder


def register(app: typer.Typer) -> None:
    app.command(epilog="Example: flight step cubli_asteroid -c 'until controller.funnel.attitude_xi[0] > 0.5' -c 'print "
                       "controller.funnel'")(step)


def step(
    source: Annotated[str, typer.Argument(metavar="BAG|SCENARIO", help="BAG, BAG@SECONDS, or a scenario's name or file.")],
    engine: Annotated[str, typer.Option(help="compiled, or python (pdb goes into the kernels).")] = "compiled",
    settings: Settings = None,
    commands: Annotated[list[str] | None, typer.Option(
        "--command", "-c", help="Do this and end; may be repeated. Lines of standard input do the same.")] = None,
    check_bounds: CheckBounds = False,
    trust: Trust = False,
) -> None:
    """Step through a run: to a time, a tick, a firing or a condition, back again bit for bit, look, plot, compare, branch.

    help lists the commands. A bag is run from itself, from its nearest checkpoint; a failed -c ends with status 2.
    """
    if engine not in ("compiled", "python"):
        raise FlightError(f"--engine {engine}: a run is stepped through by the compiled engine, or in plain Python")
    prepare_engine(engine)
    from flight_graph.graphs.overrides import parse_settings
    from flight_graph.stepping.debugger import Debugger
    from flight_graph.stepping.stepper import Stepper
    interactive = not commands and sys.stdin.isatty() and sys.stdout.isatty()
    with steps(str(source), interactive) as advance:
        run = Stepper(source, parse_settings(settings), asked(trust), check_bounds,
                      lambda seconds: advance(seconds, None, "s simulated"))
    run.progress = lambda seconds: None
    for note in run.notes:
        status(f"warning: {note}")
    debugger = Debugger(run, _say, asked(trust))
    if interactive:
        _talk(debugger)
        return
    for line in commands if commands else iter(sys.stdin.readline, ""):
        debugger.do(line)
        if debugger.done:
            return
    print(debugger.prompt().removesuffix("> "))


def _say(text: str) -> None:
    console.print(text, highlight=False, markup=False, soft_wrap=True)


def _talk(debugger) -> None:
    """Read lines at the terminal until it is enough."""
    from pathlib import Path

    from prompt_toolkit import PromptSession
    from prompt_toolkit.completion import WordCompleter
    from prompt_toolkit.history import FileHistory, InMemoryHistory
    try:
        history = FileHistory(str(Path.home() / HISTORY))
    except RuntimeError:
        history = InMemoryHistory()
    session = PromptSession(history=history)
    status("help lists the commands; an empty line repeats a step; Ctrl-D ends")
    while not debugger.done:
        words = WordCompleter([*debugger.commands(), *debugger.words()], WORD=True)
        try:
            debugger.do(session.prompt(debugger.prompt(), completer=words, complete_while_typing=False))
        except EOFError:
            return
        except KeyboardInterrupt:
            status("interrupted")
        except FlightError as error:
            status(f"error: {error}")
