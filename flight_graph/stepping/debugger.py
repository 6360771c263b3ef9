"""The commands of ``flight step``: one line in, sentences out; without a terminal, so that a script can give them, too."""

import pdb
import shlex
from pathlib import Path

import numpy as np
from numba import config

from flight_graph import yaml_text
from flight_graph.errors import FlightError, unknown
from flight_graph.graphs import placements
from flight_graph.recordings.recorded_run import open_recorded
from flight_graph.stepping import fields
from flight_graph.stepping.difference import first_difference
from flight_graph.stepping.picture import draw
from flight_graph.stepping.stepper import Stepper
from flight_graph.text_files import short

SHORT = {"u": "until", "s": "step", "b": "back", "p": "print", "w": "where", "q": "quit", "h": "help"}


class Debugger:
    """Does what a line says. say(sentence): to the person. ``done``: it was told to quit."""

    def __init__(self, run: Stepper, say, trust=False):
        self.run, self.done, self._say, self._trust, self._last = run, False, say, trust, ""

    @staticmethod
    def commands() -> dict[str, str]:
        """name -> what it does."""
        return {name.removeprefix("do_"): method.__doc__ for name, method in vars(Debugger).items()
                if name.startswith("do_")}

    def words(self) -> list[str]:
        """What may stand behind a command, for completion."""
        return [*self.run.scenario.graph.nodes, *fields.every_name(self.run.schedule)]

    def prompt(self) -> str:
        """Where the run stands."""
        upcoming = self.run.upcoming
        what = "stopped" if self.run.stopped else "end" if upcoming is None else f"{upcoming[0]}.{upcoming[1]}"
        return f"t = {self.run.t_s:.9g} s, tick {self.run.tick}, next {what}> "

    def do(self, line: str) -> None:
        """Do what a line says; an empty one repeats the last step. Raises FlightError."""
        line = line.partition("#")[0].strip() or self._last
        name, _, rest = line.partition(" ")
        name = SHORT.get(name, name)
        self._last = line if name in ("step", "back") else ""
        if not name:
            return
        method = getattr(self, f"do_{name}", None)
        if method is None:
            raise unknown("command", short(name), self.commands())
        method(rest.strip())

    # -- the commands, in the order of the help ----------------------------------------------------------------------
    def do_until(self, rest: str) -> None:
        """until SECONDS | tick N | COMPONENT | CONDITION: run there, as until controller.funnel.attitude_xi[0] > 0.9"""
        if not rest:
            raise FlightError(f"until what? {self.commands()['until']}")
        first, _, number = rest.partition(" ")
        if first == "tick" and number.strip().isdecimal():
            came = self.run.until(tick=int(number))
        else:
            came = self.run.until(_number(rest) if _number(rest) is not None else rest)
        if not came:
            self._say(self.run.stopped or "it did not come to pass before the end of the run")

    def do_step(self, rest: str) -> None:
        """step [N] | step N ticks: go on by one firing, by N, or by N ticks"""
        count, ticks = _count(rest, "step")
        if not (self.run.step(ticks=count) if ticks else self.run.step(count)):
            self._say(self.run.stopped or "the run is over")

    def do_back(self, rest: str) -> None:
        """back [N] | back N ticks: take back one firing, N, or N ticks, bit for bit"""
        count, ticks = _count(rest, "back")
        if not (self.run.back(ticks=count) if ticks else self.run.back(count)):
            self._say("this is where the run begins")

    def do_print(self, rest: str) -> None:
        """print NAME ...: show records or numbers of them, as print estimator.state controller.command.effort[0]"""
        if not rest:
            raise FlightError(f"print what? {self.commands()['print']}")
        for name in rest.split():
            found = fields.find(name, self.run.schedule, "print")
            unit = fields.unit(found, self.run.schedule)
            for line in _lines(name, found.read(self.run.flight.arrays), f" {unit}" if unit else ""):
                self._say(line)

    def do_plot(self, rest: str) -> None:
        """plot NAME [SECONDS] [FILE.png]: draw a number's last seconds (10 when left out) into a file"""
        name, *others = shlex.split(rest) or [""]
        if not name:
            raise FlightError(f"plot what? {self.commands()['plot']}")
        seconds = next((number for one in others if (number := _number(one)) is not None), 10.0)
        files = [one for one in others if _number(one) is None]
        if not 0 < seconds < 1e9 or len(files) > 1:
            raise FlightError(f"plot {short(rest)}: write {self.commands()['plot'].partition(':')[0]}")
        times, values = self.run.history(name, seconds)
        unit = fields.unit(fields.find(name, self.run.schedule), self.run.schedule)
        self._say(str(draw(times, values, f"{name} {unit}".strip(), Path(files[0]) if files else None)))

    def do_diff(self, rest: str) -> None:
        """diff [BAG]: run on to the first message that differs from another run's bag (its own when left out)"""
        if not rest and self.run.recorded is None:
            raise FlightError("diff with which bag? The run that is stepped through comes from a scenario")
        other = open_recorded(Path(shlex.split(rest)[0]), self._trust) if rest else self.run.recorded
        if self.run.flight.fired:
            self.run.until(tick=self.run.tick)
        found = first_difference(self.run, other)
        self._say(str(found) if found else self.run.stopped or f"equal to {other.bag.path} until here")

    def do_branch(self, rest: str) -> None:
        """branch COMPONENT.PARAMETER=VALUE ...: go on from this tick with something set, and never behind it"""
        settings = {}
        for text in shlex.split(rest):
            key, equals, value = text.partition("=")
            if not key or not equals:
                raise FlightError(f"branch {short(text)}: write COMPONENT.PARAMETER=VALUE")
            settings[key] = yaml_text.parse(value, f"branch {short(key)}")
        if not settings:
            raise FlightError(f"branch with what? {self.commands()['branch']}")
        self.run = self.run.branch(settings)
        for note in self.run.notes:
            self._say(f"warning: {note}")

    def do_place(self, rest: str) -> None:
        """place COMPONENT.QUANTITY=[NUMBERS]; ...: go on from this tick with something put elsewhere"""
        found = placements.parse(rest, "place")
        if not found:
            raise FlightError(f"place what? {self.commands()['place']}")
        self.run = self.run.branch(place=found)

    def do_pdb(self, rest: str) -> None:
        """pdb: the next firing in Python's debugger, inside of its kernel (with --engine python); its q takes it back"""
        if not config.DISABLE_JIT:
            raise FlightError("the kernels are machine code here; flight step ... --engine python breaks into them")
        inside = _Pdb()
        self.run.step(around=inside.runcall)
        if inside.was_left:
            self.run.back()
            self._say("the firing was left, and is taken back")

    def do_where(self, rest: str) -> None:
        """where: time, tick, what comes next, and from where this run is"""
        run = self.run
        period_ms = run.scenario.graph.base_ns / 1e6
        self._say(f"{run.scenario.name}: t = {run.t_s:.9g} s, tick {run.tick} of {run.scenario.ticks} ({period_ms:g} ms)"
                  + (f", {run.flight.fired} of its firings are over" if run.flight.fired else ""))
        if run.stopped:
            self._say(run.stopped)
        firings = [run.schedule.firings[number] for number in run.flight.due(run.tick)]
        order = [f"{firing.node}.{firing.part}" for firing in firings]
        self._say(f"in this tick fire {', '.join(order) or 'none'}")
        if run.recorded and run.recorded.begin:
            self._say(run.recorded.begin.sentence())

    def do_list(self, rest: str) -> None:
        """list [COMPONENT]: components with their rates, or all that can be printed of one"""
        nodes = self.run.scenario.graph.nodes
        if rest and rest not in nodes:
            raise unknown("component", short(rest), nodes, "list")
        for line in [one for one in fields.every_name(self.run.schedule) if one.startswith(f"{rest}.")] if rest else [
                f"{name}: {node.rate_hz:g} Hz; {', '.join(node.component.outputs) or 'no outputs'}"
                for name, node in nodes.items()]:
            self._say(line)

    def do_help(self, rest: str) -> None:
        """help: this list; u, s, b, p, w and q stand for until, step, back, print, where and quit"""
        for text in self.commands().values():
            self._say(text)

    def do_quit(self, rest: str) -> None:
        """quit: end"""
        self.done = True


class _Pdb(pdb.Pdb):
    """Python's debugger, which knows whether it was left before the function's end."""

    was_left = False

    def set_quit(self):
        self.was_left = True
        super().set_quit()


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _count(rest: str, command: str) -> tuple[int, bool]:
    """(number, whether of ticks)."""
    words = rest.split() or ["1"]
    if not words[0].isdecimal() or int(words[0]) < 1 or len(words[0]) > 12 or words[1:] not in ([], ["tick"], ["ticks"]):
        raise FlightError(f"{command} {short(rest)}: write {command}, {command} N or {command} N ticks")
    return int(words[0]), len(words) > 1


def _lines(name, value, unit=""):
    """A value as lines."""
    if not isinstance(value, dict):
        yield f"{name} = {_text(value)}{unit}"
        return
    for key, inner in value.items():
        yield from _lines(f"{name}.{key}", inner)


def _text(value) -> str:
    if isinstance(value, np.ndarray):
        return np.array2string(value, separator=", ", floatmode="unique", max_line_width=110, threshold=64)
    return repr(value)
