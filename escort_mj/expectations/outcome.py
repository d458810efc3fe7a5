"""How a run ends."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from escort_mj.expectations.expectation import Expectation, Judgment, not_judged
from escort_mj.record.outcome import FINAL
from escort_mj.record.recording import LOG_OF, Recorded, ends_early, is_log

if TYPE_CHECKING:
    from escort_mj.record.outcome import Outcome


class OutcomeExpectation(Expectation):
    """The required outcome of the run; without this expectation, `completed` is required."""

    kind = "outcome"
    rank = 60

    outcome: Literal["completed", "diverged", "unstable"]
    """`diverged`: a robot moved far away or a number is not finite; `unstable`: MuJoCo issued a warning."""

    def judge_run(self, trace: Recorded, outcome: Outcome) -> Judgment:
        """Whether the run ended so."""
        if is_log(trace) and self.outcome != "completed" and outcome.good:
            return not_judged("only a simulation can end so")
        if is_log(trace) and outcome.good and (short := ends_early(trace, trace.attrs[LOG_OF])):
            return not_judged(f"{short} of {trace.attrs[LOG_OF]:g} s")
        words = outcome.value if outcome.good else f"{outcome.value}, {outcome.meaning}"
        time = float(trace["time"][-1]) if trace.sizes["time"] and not outcome.good else None
        held, ended = outcome.value == self.outcome, outcome.value in FINAL
        return Judgment(held, words, time=time, unknown=not ended)  # such as by an error of a plugin

    @property
    def reads_samples(self) -> bool:
        """It sees every physics step."""
        return False

    @property
    def demanded(self) -> str:
        """The end in a word."""
        return self.outcome
