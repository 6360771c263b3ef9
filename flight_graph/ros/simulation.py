"""What can be asked of a run that is controlled, whatever service it is asked by: states, steps, resets, and their answers.

States and codes are those of simulation_interfaces, a package that need not be installed. The work is done by others: the
clock master stands, steps and runs (`flight_graph.ros.pacing`), and who started the nodes begins a new segment.
"""

import threading
from contextlib import contextmanager
from dataclasses import dataclass

from flight_graph.errors import FlightError
from flight_graph.ros import simulation_settings as said
from flight_graph.ros.simulation_settings import Order, Report
from flight_graph.timebase import SECOND

STOPPED, PLAYING, PAUSED, QUITTING = range(4)
STATES = {STOPPED: "stopped", PLAYING: "playing", PAUSED: "paused", QUITTING: "quitting"}
UNSUPPORTED, OK, NOT_FOUND, INCORRECT_STATE, FAILED = range(5)
ALREADY_THERE, INCORRECT_TRANSITION, INVALID_POSE = 101, 103, 101
_STEP, _RESET, _QUIT, _PUT = "a step", "a reset", "the end of the run", "a change of where something is"


@dataclass(frozen=True)
class Answer:
    """The answer to a call. code: of simulation_interfaces; text: a sentence; is_ok: whether what was asked for is so."""

    code: int
    text: str

    @property
    def is_ok(self) -> bool:
        return self.code in (OK, ALREADY_THERE)


@dataclass(frozen=True)
class Limits:
    """What a run allows. base_ns: the period of its clock master; begin_ns, end_ns: of the run; lockstep; why_no_reset,
    why_only_start: a sentence where it cannot be taken back at all, or to its start alone.
    """

    base_ns: int
    begin_ns: int
    end_ns: int
    lockstep: bool
    why_no_reset: str = ""
    why_only_start: str = ""


class Simulation:
    """One controlled run. send(text): an order to the clock master; tell(dict): to who started the nodes.

    The methods block until what they ask for is done, and may be called from several threads.
    """

    def __init__(self, limits: Limits, send, tell):
        self.limits, self._send, self._tell = limits, send, tell
        self._changed = threading.Condition()
        self._report = Report(0, 0, limits.begin_ns, True, 0.0)
        self._number, self._busy = 0, ""
        self._is_fresh = True  # it stands at the start, and nobody has said that it is to be paused there
        self._is_over = self._is_closed = False
        self._stepped = 0, 0  # number of the order behind the last steps, and how many they were

    # -- what is heard -------------------------------------------------------------------------------------------
    def take(self, report: Report) -> None:
        """A report of the clock master."""
        with self._changed:
            if report.segment < self._report.segment:
                return
            if report.segment > self._report.segment:
                self._number, self._stepped = 0, (0, 0)
            self._report = report
            self._is_over |= report.is_over
            if report.done == said.STEPPED:
                self._stepped = report.number, report.ticks
            self._changed.notify_all()

    def close(self) -> None:
        """Nothing more will be heard: calls that wait are answered."""
        with self._changed:
            self._is_over = self._is_closed = True
            self._changed.notify_all()

    # -- what is asked -------------------------------------------------------------------------------------------
    @property
    def state(self) -> int:
        with self._changed:
            return self._state()

    def _state(self):
        if self._is_over or self._busy == _QUIT:
            return QUITTING
        if self._busy == _STEP or not self._report.stands:
            return PLAYING
        return STOPPED if self._is_fresh else PAUSED

    def set_state(self, wanted: int) -> Answer:
        """Bring the run into a state."""
        change = {STOPPED: self._stop, PLAYING: self._play, PAUSED: self._pause, QUITTING: self._quit}.get(wanted)
        if change is None:
            return Answer(INCORRECT_TRANSITION, f"{wanted} is no state that a run can be brought into; allowed: "
                          + ", ".join(f"{number} ({name})" for number, name in STATES.items()))
        with self._changed:
            state = self._state()
            if refused := self._refusal(may_step=wanted == PAUSED):
                return refused
        if state == wanted:
            return Answer(ALREADY_THERE, f"the run is {STATES[state]} already{self._where()}")
        return change()

    def step(self, count: int, each=None) -> Answer:
        """Fire the clock master so many times and stand again. each(done, left): steps are made singly, this is called
        after each, and ends them where it returns False.
        """
        with self._changed:
            if refused := self._refusal():
                return refused
            if (state := self._state()) != PAUSED:
                return Answer(FAILED, f"the run is {STATES[state]}; steps are made where it is paused")
            if count < 1:
                return Answer(FAILED, f"{count} steps: allowed: at least 1")
        with self._exclusively(_STEP) as refused:
            return refused or self._steps(count, each)

    def place(self, name: str, put, is_pose: bool) -> Answer:
        """Put an entity elsewhere before the next tick: put() does it, or raises FlightError; is_pose: its pose too."""
        with self._changed:
            if refused := self._refusal():
                return refused
            if (state := self._state()) != PAUSED:
                return Answer(INCORRECT_STATE, f"the run is {STATES[state]}; things are put elsewhere where it is paused")
        with self._exclusively(_PUT) as refused:
            if refused:
                return refused
            try:
                put()
            except FlightError as error:
                return Answer(INVALID_POSE if is_pose else FAILED, str(error))
            return self._answer(f"{name} is put elsewhere")

    def reset(self, to_ns: int) -> Answer:
        """Take the run back to a time; it plays on from there if it did."""
        return self._reset(to_ns, goes_on=True)

    def check_reset(self, to_ns: int) -> None:
        """Refuse a time to go back to. Raises FlightError."""
        limits = self.limits
        if limits.why_no_reset:
            raise FlightError(limits.why_no_reset)
        if not limits.begin_ns <= to_ns < limits.end_ns or to_ns % limits.base_ns:
            raise FlightError(f"there is no tick at t = {to_ns / SECOND:.9g} s; the run has one every "
                              f"{limits.base_ns / SECOND:.9g} s, from {limits.begin_ns / SECOND:.9g} to before "
                              f"{limits.end_ns / SECOND:.9g} s")
        if limits.why_only_start and to_ns != limits.begin_ns:
            raise FlightError(f"{limits.why_only_start}: it goes back to its start alone, "
                              f"t = {limits.begin_ns / SECOND:.9g} s")

    def check_rate(self, rate: float) -> None:
        """Refuse a rate. Raises FlightError."""
        if not 0.0 <= rate < float("inf") or not (rate or self.limits.lockstep):
            raise FlightError(f"rate: {rate:g} is not allowed; allowed: simulated seconds per wall second, greater than 0"
                              + (", or 0: as fast as the graph answers" if self.limits.lockstep else ""))

    def set_rate(self, rate: float) -> None:
        """Run at so many simulated seconds per wall second from the next firing on; 0: as fast as the graph answers."""
        with self._changed:
            self._order(said.RATE, rate=rate)

    def summary(self) -> dict:
        """The state in words and numbers."""
        with self._changed:
            report = self._report
            return {"state": STATES[self._state()], "t_s": report.t_ns / SECOND, "stands": report.stands,
                    "rate": report.rate, "segment": report.segment}

    # -- how it is done ------------------------------------------------------------------------------------------
    def _play(self):
        self._ask(said.RUN)
        self._is_fresh = False
        return self._answer("the run plays")

    def _pause(self):
        if self.state != STOPPED:
            self._ask(said.STAND)
        self._is_fresh = False
        return self._answer("the run is paused")

    def _stop(self):
        return self._reset(self.limits.begin_ns, goes_on=False)

    def _quit(self):
        with self._exclusively(_QUIT) as refused:
            if refused:
                return refused
            self._ask(said.STAND)
            self._ask(said.NOTE, note="ended by who controls it")
            self._is_over = True
            self._tell({"quit": True})
            return Answer(OK, f"the run ends, its bag is closed{self._where()}")

    def _steps(self, count, each):
        made, wanted = 0, 1 if each else count
        while made < count:
            number = self._ask(said.STEP, lambda number: self._stepped[0] >= number, steps=wanted)
            ticks = self._stepped[1] if self._stepped[0] >= number else 0
            made += ticks
            if ticks < wanted or self._is_over or (each and not each(made, count - made)):
                break
        if made == count:
            return Answer(OK, f"{made} steps{self._where()}")
        why = "the run is over" if self._is_over else "it was paused"
        return Answer(FAILED, f"{why} after {made} of {count} steps{self._where()}")

    def _reset(self, to_ns, goes_on):
        try:
            self.check_reset(to_ns)
        except FlightError as error:
            return Answer(UNSUPPORTED if self.limits.why_no_reset else FAILED, str(error))
        with self._exclusively(_RESET) as refused:
            return refused or self._go_back(to_ns, goes_on)

    def _go_back(self, to_ns, goes_on):
        played = not self._report.stands
        self._ask(said.STAND)
        here_ns = self._report.t_ns
        if self._is_over:
            return self._answer("")
        if to_ns < here_ns:
            self._begin_segment(to_ns, here_ns)
        self._is_fresh |= not goes_on
        if played and (goes_on or to_ns > here_ns):
            self._ask(said.RUN)
        if to_ns > here_ns:
            return Answer(FAILED, f"the run has come to t = {here_ns / SECOND:.9g} s; it cannot be taken back to "
                          f"t = {to_ns / SECOND:.9g} s")
        return self._answer(f"the run was taken back to t = {to_ns / SECOND:.9g} s")

    def _begin_segment(self, to_ns, here_ns):
        self._ask(said.NOTE, note=f"taken back to t = {to_ns / SECOND:.9g} s")
        with self._changed:
            segment = self._report.segment
            self._tell({"reset": to_ns, "from_ns": here_ns, "rate": self._report.rate})
            self._changed.wait_for(lambda: self._is_closed or self._report.segment > segment)

    # -- with the lock -------------------------------------------------------------------------------------------
    def _refusal(self, may_step=False) -> Answer | None:
        if self._is_over:
            return Answer(INCORRECT_STATE, "the run is over")
        if self._busy and not (may_step and self._busy == _STEP):
            return Answer(INCORRECT_STATE, f"{self._busy} is under way")
        return None

    @contextmanager
    def _exclusively(self, what):
        """Hold off others for the block; gives a refusal where another one is under way."""
        with self._changed:
            refused = self._refusal()
            if not refused:
                self._busy = what
        try:
            yield refused
        finally:
            if not refused:
                self._busy = ""

    def _ask(self, do, until=None, **fields) -> int:
        """Send an order, wait until it is obeyed, and until a condition on its number holds; return the number."""
        with self._changed:
            number = self._order(do, **fields)
            self._changed.wait_for(lambda: self._is_over or self._report.number >= number and (
                until is None or until(number)))
            return number

    def _order(self, do, **fields) -> int:
        self._number += 1
        self._send(Order(self._report.segment, self._number, do, **fields).text())
        return self._number

    def _answer(self, text):
        if self._is_over:
            return Answer(FAILED, "the run is over")
        return Answer(OK, text + self._where())

    def _where(self) -> str:
        return f"; t = {self._report.t_ns / SECOND:.9g} s" if self._report.stands else ""
