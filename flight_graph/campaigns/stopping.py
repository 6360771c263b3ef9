"""The stopping rule of a campaign, ``vary.until``, asked after fixed numbers of cases, in case order.

Where a campaign ends is a function of its rows alone: chunks that came back early, from beyond the end, are kept, and no
reader counts them.
"""

from collections.abc import Callable
from dataclasses import replace

import pyarrow

from flight_graph.campaigns.chunk import Damaged
from flight_graph.campaigns.folder import Campaign
from flight_graph.errors import unknown
from flight_graph.statistics.stopping import StoppingRule, Until, Verdict


class Looks:
    """The looks at a campaign that is being filled. Without a rule there is none."""

    def __init__(self, campaign: Campaign):
        self._campaign, self._verdict, manifest = campaign, None, campaign.manifest
        self.rule, self._next, self._cases = None, 0, 0
        if manifest.vary.get("until"):
            self.until = Until.model_validate(manifest.vary["until"])
            self._groups = manifest.combinations
            self.rule = StoppingRule(self.until, manifest.runs, manifest.chunk, self._groups)
            self._counts = [[0, 0] for _ in range(self._groups)]

    def verdict(self) -> Verdict | None:
        """What ends the campaign, once its first parts say so. Raises FlightError when there is no such metric."""
        while self.rule is not None and self._verdict is None and self._take():
            if self._cases in self.rule.looks:
                found = self.rule.verdict(self._cases, [tuple(count) for count in self._counts])
                self._verdict = found if found.stop else None
        return self._verdict

    def _take(self) -> bool:
        """Count the next chunk, where it is there."""
        if self._next not in self._campaign.manifest.chunks:
            return False
        wanted = self._campaign.manifest.cases(self._next)
        try:
            part = self._campaign.read_part(self._next)
        except (FileNotFoundError, Damaged):
            return False
        if part.rows < len(wanted):
            return False
        table = part.table
        if self.until.metric not in table.schema.names:
            if "ok" in table.column("status").to_pylist():
                raise unknown("metric", self.until.metric, _metrics(table), "vary.until")
            values = [None] * part.rows
        else:
            values = table.column(self.until.metric).to_pylist()
        for case, value in zip(table.column("case").to_pylist(), values):
            count = self._counts[case % self._groups]
            count[0] += self.until.success(value)
            count[1] += 1
        self._next, self._cases = self._next + 1, self._cases + part.rows
        return True

    def close(self, tell: Callable[[str], None]) -> Campaign:
        """The campaign with the end that the rule gave it, which is written down and said."""
        campaign, verdict = self._campaign, self._verdict
        if verdict is None:
            return campaign
        rates = "; ".join(f"{rate.value:.4g} in [{rate.low:.4g}, {rate.high:.4g}]" for rate in verdict.rates[:3])
        if verdict.enough:
            sentence = f"ended by its stopping rule after {verdict.runs} runs: {self.until.metric} {rates}"
        else:
            sentence = (f"the stopping rule is not met after all {verdict.runs} runs: {self.until.metric} {rates}; --runs "
                        "extends the campaign")
        tell(sentence)
        ended = {"runs": verdict.runs, "sentence": sentence} if verdict.enough else None
        if ended != campaign.manifest.ended:
            campaign = replace(campaign, manifest=replace(campaign.manifest, ended=ended))
            campaign.manifest.save(campaign.path)
        return campaign


def _metrics(table: pyarrow.Table) -> list[str]:
    return [one.name for one in table.schema if (one.metadata or {}).get(b"kind") == b"metric"]


