"""Faults that are injected while a run flies: which there are, and what a new one, or the end of one, is as data."""

from flight_graph.errors import FlightError, unknown

_NOT_LIVE = ("from_s", "until_s", "at_s", "when", "id")


class Injections:
    """live_ids: the places that a scenario keeps (``live_faults``). where: what sentences begin with.

    entries: id -> fault as data; who has taken one puts it there.
    """

    def __init__(self, live_ids: list[str], where: str = ""):
        self.live_ids, self.entries, self._where = live_ids, {}, where

    def check(self, fault) -> None:
        """See that it is a fault as in a scenario's block, without id and times. Raises FlightError."""
        if not isinstance(fault, dict):
            raise self._refused("it is one fault: {at: ..., type: ..., value: ...}")
        for key in _NOT_LIVE:
            if key in fault:
                raise self._refused(f"an injected fault begins now; it has no {key} (for_s says how long it lasts)")

    def begun(self, fault: dict, begin_s: float) -> tuple[dict, str]:
        """(the fault in a free place, what is said of it). Raises FlightError where all are taken."""
        free = [name for name in self.live_ids if name not in self.entries]
        if not free:
            raise self._refused(f"all {len(self.live_ids)} places are taken; each serves for one fault of the run, over or "
                                "not; the scenario's live_faults says how many there are")
        return {**fault, "id": free[0], "from_s": begin_s}, f"{free[0]} begins at t = {begin_s:.9g} s"

    def ended(self, name: str, end_s: float, where: str = "") -> tuple[dict, str]:
        """(an injected fault that ends, what is said of it). Raises FlightError where there is none of this name."""
        if name not in self.entries:
            raise unknown("injected fault", name, self.entries, where)
        kept = {key: value for key, value in self.entries[name].items() if key != "for_s"}
        return {**kept, "until_s": end_s}, f"{name} ends at t = {end_s:.9g} s"

    def _refused(self, sentence):
        return FlightError(f"{self._where}: {sentence}" if self._where else sentence)
