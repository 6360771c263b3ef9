"""What calls of a controlled run are answered, with the codes of simulation_interfaces; a clock master is played."""

import json
import threading

import pytest

from flight_graph.errors import FlightError
from flight_graph.ros import simulation as control
from flight_graph.ros.simulation import Limits, Simulation
from flight_graph.ros.simulation_settings import Report
from flight_graph.timebase import SECOND
from tests.ros.processes import until

TICK = 10_000_000  # [ns]


class Master:
    """Obeys at once, for a run of a hundred ticks. slow: does not finish its steps."""

    def __init__(self, limits=None, slow=False):
        self.tick, self.segment, self.slow, self.told = 0, 0, slow, []
        self.run = Simulation(limits or Limits(TICK, 0, 100 * TICK, True), self.obey, self.hear)

    def obey(self, text):
        order, done, ticks, stands = json.loads(text), "", 0, True
        assert order["segment"] == self.segment
        if order["do"] == "step":
            if self.slow:
                return
            ticks, done = min(order["steps"], 100 - self.tick), "stepped"
            self.tick += ticks
        elif order["do"] == "run":
            stands, done = False, "played"
        elif order["do"] == "stand" and self.slow:
            self.report(order["number"], "stepped", 3, True)
            done = "paused"
        self.report(order["number"], done, ticks, stands)

    def report(self, number, done="", ticks=0, stands=True):
        is_over = self.tick >= 100
        self.run.take(Report(self.segment, number, self.tick * TICK, stands and not is_over, 0.0, done, ticks, is_over))

    def hear(self, event):
        self.told.append(event)
        if "reset" in event:
            self.tick, self.segment = event["reset"] // TICK, self.segment + 1
            threading.Thread(target=self.report, args=(0,)).start()

    def set(self, state):
        return self.run.set_state(state).code


def test_states_follow_each_other_as_the_standard_says():
    master = Master()
    assert master.run.state == control.STOPPED and master.set(control.STOPPED) == control.ALREADY_THERE
    assert master.set(control.PAUSED) == control.OK and master.run.state == control.PAUSED
    assert master.set(control.PLAYING) == control.OK and master.run.state == control.PLAYING
    assert master.set(control.PLAYING) == control.ALREADY_THERE
    assert master.set(control.PAUSED) == control.OK and master.set(control.PAUSED) == control.ALREADY_THERE
    for wrong in (4, 5, 9):
        answer = master.run.set_state(wrong)
        assert answer.code == control.INCORRECT_TRANSITION and f"{wrong} is no state" in answer.text
    assert master.set(control.STOPPED) == control.OK and master.run.state == control.STOPPED
    assert master.set(control.QUITTING) == control.OK and master.run.state == control.QUITTING
    assert master.told[-1] == {"quit": True}
    assert master.set(control.PLAYING) == control.INCORRECT_STATE


def test_steps_are_made_where_it_is_paused_and_counted_where_they_end_early():
    master = Master()
    assert master.run.step(1) == control.Answer(control.FAILED, "the run is stopped; steps are made where it is paused")
    master.set(control.PAUSED)
    assert master.run.step(0).code == control.FAILED
    assert master.run.step(7) == control.Answer(control.OK, "7 steps; t = 0.07 s")
    told = []
    assert master.run.step(3, lambda done, left: told.append((done, left)) or True).code == control.OK
    assert told == [(1, 2), (2, 1), (3, 0)]
    assert master.run.step(5, lambda done, left: done < 2).text == "it was paused after 2 of 5 steps; t = 0.12 s"
    answer = master.run.step(1000)
    assert answer == control.Answer(control.FAILED, "the run is over after 88 of 1000 steps")
    assert master.run.step(1).code == control.INCORRECT_STATE


def test_a_step_that_takes_long_can_be_paused_and_holds_off_all_else():
    master, answers = Master(slow=True), []
    master.set(control.PAUSED)
    thread = threading.Thread(target=lambda: answers.append(master.run.step(10)))
    thread.start()
    until(lambda: master.run.state == control.PLAYING)
    for refused in (master.run.step(1), master.run.reset(0), master.run.set_state(control.QUITTING)):
        assert refused == control.Answer(control.INCORRECT_STATE, "a step is under way")
    assert master.set(control.PAUSED) == control.OK
    thread.join(10.0)
    assert answers == [control.Answer(control.FAILED, "it was paused after 3 of 10 steps; t = 0 s")]


def test_things_are_put_elsewhere_where_it_is_paused():
    master, put = Master(), []

    def refuse():
        raise FlightError("there is a rock")

    assert master.run.place("rover", refuse, True) == control.Answer(
        control.INCORRECT_STATE, "the run is stopped; things are put elsewhere where it is paused")
    master.set(control.PAUSED)
    assert master.run.place("rover", lambda: put.append(1), True).code == control.OK and put == [1]
    assert master.run.place("rover", refuse, True) == control.Answer(control.INVALID_POSE, "there is a rock")
    assert master.run.place("rover", refuse, False).code == control.FAILED
    assert master.run.step(1).code == control.OK
    master.set(control.PLAYING)
    assert master.run.place("rover", refuse, True).code == control.INCORRECT_STATE


@pytest.mark.parametrize("limits, code, sentence", [
    (Limits(TICK, 0, 100 * TICK, True, why_no_reset="nobody takes it back"), control.UNSUPPORTED, "nobody takes it back"),
    (Limits(TICK, 0, 100 * TICK, False, why_only_start="realtime"), control.FAILED, "realtime: it goes back to its start"),
    (Limits(TICK, 3 * TICK, 100 * TICK, True), control.FAILED, "from 0.03 to before 1 s"),
])
def test_a_reset_that_has_no_meaning_is_refused(limits, code, sentence):
    answer = Master(limits).run.reset(TICK)
    assert answer.code == code and sentence in answer.text


def test_a_reset_goes_on_as_it_was_a_thousand_times():
    master = Master()
    master.set(control.PAUSED)
    for _ in range(1000):
        master.run.step(5)
        assert master.run.reset(2 * TICK).is_ok and master.run.state == control.PAUSED
    assert master.told[-1] == {"reset": 2 * TICK, "from_ns": 5 * TICK + 2 * TICK, "rate": 0.0} and master.segment == 1000
    master.set(control.PLAYING)
    master.tick = 50
    assert master.run.reset(10 * TICK).text == "the run was taken back to t = 0.1 s" and master.run.state == control.PLAYING
    assert master.run.reset(90 * TICK).code == control.FAILED and master.run.state == control.PLAYING
    assert master.run.reset(10 * SECOND).code == control.FAILED


def test_who_waits_is_answered_when_the_run_is_closed():
    master, answers = Master(slow=True), []
    master.set(control.PAUSED)
    thread = threading.Thread(target=lambda: answers.append(master.run.step(10)))
    thread.start()
    until(lambda: master.run.state == control.PLAYING)
    master.run.close()
    thread.join(10.0)
    assert answers == [control.Answer(control.FAILED, "the run is over after 0 of 10 steps; t = 0 s")]
