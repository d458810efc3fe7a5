"""From a trace and what was expected of it to verdicts: what held, by how much, when, and who."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from escort_mj.errors import NotLoggedError, PluginCallError
from escort_mj.expectations.expectation import Expectation, Judgment, checked, not_judged
from escort_mj.expectations.outcome import OutcomeExpectation
from escort_mj.metrics.measure import in_words
from escort_mj.metrics.reading import robots
from escort_mj.numerics.steps import first_step, last_step
from escort_mj.plugin_calls import calling, is_plugins
from escort_mj.record.outcome import Outcome, Verdict
from escort_mj.record.recording import LOG_OF, Recorded, ends_early, gaps_of, is_log, lent
from escort_mj.record.tables import aligned
from escort_mj.record.team import team_names
from escort_mj.record.window import end_of, window

MOST_GAPS = 3  # that a verdict lists


def judge(expectations: Sequence[Expectation], trace: Recorded, outcome: Outcome) -> list[Verdict]:
    """Judge a run: its outcome first, then every expectation.

    Args:
        expectations: From the scenario.
        trace: The whole trace.
        outcome: How the run ended.
    """
    verdicts = [judge_one(one, trace, outcome, place) for place, one in enumerate(expectations)]
    endings = [place for place, one in enumerate(expectations) if judges_outcome(one)]
    if endings:
        return [verdicts.pop(endings[0]), *verdicts]
    completed = judge_one(OutcomeExpectation(outcome="completed"), trace, outcome)
    return [completed, *verdicts]


def judges_outcome(expectation: Expectation) -> bool:
    """Whether an expectation says how the run is to end, in place of the verdict that every run has.

    One that is skipped does not: how a run ended is judged whatever is skipped.
    """
    return isinstance(expectation, OutcomeExpectation) and expectation.skip is None


def judge_one(
    expectation: Expectation, trace: Recorded, outcome: Outcome, place: int | None = None
) -> Verdict:
    """Judge one expectation.

    Args:
        expectation: What is expected.
        trace: The whole trace.
        outcome: How the run ended.
        place: Its place in the scenario's list.
    """
    skip = expectation.skip or _unlogged(expectation, trace)
    if skip:
        demanded, found, broken = _demanded(expectation), Judgment(True, f"not judged: {skip}"), False
    else:
        demanded, found, broken = _judged(expectation, trace, outcome)
        skip = found.skip
        found = found if skip else _unless_unseen(expectation, found, trace, outcome)
        found = found if broken else _told(expectation, found, trace)
    known = "" if skip else expectation.xfail or ""
    message = f"{expectation.subject} {demanded}: {found.words}"
    if not skip:
        message += _around_gaps(expectation, trace)
    if known:
        how = "expected failure" if not found.held else "passed, but failure was expected"
        message += f"; {'a failure was expected, but nothing was judged' if found.unknown else how}: {known}"
    return Verdict(
        metric=expectation.subject,
        demanded=demanded,
        value=found.value,
        unit=found.unit,
        time=found.time,
        who=in_words(found.bodies),
        margin=found.margin,
        passed=found.held != bool(known) and not broken and not found.unknown,
        broken=broken,
        near_miss=found.near_miss,
        message=message,
        bodies=found.bodies,
        held=found.held,
        xfail=known,
        expectation=place,
        skip=skip,
    )


def _unlogged(expectation: Expectation, trace: Recorded) -> str:
    """Why nothing can be judged of a log: all of the window lies within its gaps; empty where some can."""
    missing = _gaps_within(expectation, trace)
    if missing and not window(trace, *expectation.window_in(end_of(trace))).sizes["time"]:
        return f"the log has no positions {missing}"
    return ""


def _around_gaps(expectation: Expectation, trace: Recorded) -> str:
    """What of the window is not judged, because a log has no positions there; nothing of a run."""
    missing = _gaps_within(expectation, trace)
    return f"; not judged {missing}, which the log lacks" if missing else ""


def _gaps_within(expectation: Expectation, trace: Recorded) -> str:
    """The gaps of a log within the window, in words."""
    if isinstance(expectation, OutcomeExpectation):
        return ""  # of the log as a whole, which says it
    start, end = expectation.window_in(end_of(trace))
    inside = [gap for gap in gaps_of(trace) if gap[1] > start and (end is None or gap[0] < end)]
    words = [f"from {first:.6g} to {last:.6g} s" for first, last in inside[:MOST_GAPS]]
    more = [f"in {len(inside) - MOST_GAPS} more gaps"] * (len(inside) > MOST_GAPS)
    return ", ".join(words + more)


def _demanded(expectation: Expectation) -> str:
    """What an expectation demands, with its window; its kind where a plugin cannot say."""
    try:
        return expectation.demanded + expectation.when
    except Exception:
        return expectation.kind


def _judged(expectation: Expectation, trace: Recorded, outcome: Outcome) -> tuple[str, Judgment, bool]:
    """What an expectation demands, what it found, and whether it raised an error, which is no verdict."""
    demanded, kind = expectation.kind, type(expectation)
    function = kind.judge_run if kind.judge is Expectation.judge else kind.judge
    try:
        with calling(function, is_log(trace)):
            demanded = expectation.demanded + expectation.when
            shown = lent(trace) if is_plugins(function) else trace
            found = checked(expectation.judge_run(shown, outcome), trace)
            return demanded, _as_logged(expectation, found, trace), False
    except NotLoggedError as error:
        return demanded, not_judged(str(error)), False
    except PluginCallError as error:
        return demanded, Judgment(False, str(error)), True


def _as_logged(expectation: Expectation, found: Judgment, trace: Recorded) -> Judgment:
    """The finding, unless a log ends before the window does: what fails in a part of it may fail for good."""
    start, end = expectation.window_in(float(trace.attrs.get(LOG_OF, end_of(trace))))
    short = ends_early(trace, max(start, end or 0.0))
    if not short or found.skip or (expectation.lasting and not found.held and not ends_early(trace, start)):
        return found
    return not_judged(f"{short}, {'before' if ends_early(trace, start) else 'inside'} the window")


def _unless_unseen(expectation: Expectation, found: Judgment, trace: Recorded, outcome: Outcome) -> Judgment:
    """The finding, unless it held only because the trace does not show all of the window, or is of no tail.

    The run may have broken off in it. Or the window was not known when the run was recorded: then what is
    watched between samples is known from sample to sample only; of touches there is a log.
    """
    (start, end), time = expectation.window_in(end_of(trace)), trace["time"].values
    if not outcome.good and expectation.of_end and len(time):
        nobody = found._replace(time=None, bodies=())
        return _unseen(nobody, f"the run broke off at {time[-1]:g} s, and has no tail")
    if not found.held or (not len(time) and (outcome.good or end is None)):
        return found
    if not len(time):
        return _unseen(found, "the run has no sample")
    timestep, reached = float(trace.attrs["timestep"]), float(time[-1])
    first = first_step(start, timestep) * timestep
    last = reached if end is None else last_step(end, timestep) * timestep
    if not outcome.good and max(first, last) > reached + 0.5 * timestep:
        where = "inside" if first <= reached else "before"
        return _unseen(found, f"the run ended at {reached:g} s, {where} the window")
    if expectation.sampled_at_ends:
        alone = [first - timestep] if first == last > 0.0 else []  # or the only sample knows nothing
        gaps = gaps_of(trace)
        for moment in (*alone, first, last):
            if ((gaps[:, 0] < moment) & (moment < gaps[:, 1])).any():
                continue  # which the verdict says
            if np.abs(time - moment).min() > 0.5 * timestep:
                words = f"the run has no sample at {moment:g} s, at an end of the window"
                return _unseen(found, f"{words}; expectations of the scenario itself get one there")
    return found


def _told(expectation: Expectation, found: Judgment, trace: Recorded) -> Judgment:
    """The finding, with whom it leaves out and what it does not see."""
    if found.skip or found.unknown or (found.value is None and not is_plugins(type(expectation))):
        return found
    part = window(trace, *expectation.window_in(end_of(trace)))
    return found._replace(
        words=found.words + _left_out(expectation, part) + _samples(expectation, part, trace)
    )


def _left_out(expectation: Expectation, part: Recorded) -> str:
    """Which robots an expectation leaves out because they have failed, in words; empty for none."""
    if not expectation.leaves_out:
        return ""
    gone = part["lost"].values[-1] > 0
    team = getattr(expectation, "team", None)
    if team is not None:
        gone &= part["member_of"].values[-1] == team_names(part).index(team) + 1
    which = in_words(robots(np.flatnonzero(gone)))
    return f"; without {which}, which failed" if which else ""


def _samples(expectation: Expectation, part: Recorded, trace: Recorded) -> str:
    """How far apart the samples of a window are, in words, where an expectation sees nothing else of it.

    Empty where there is one in every physics step, or all that it asks about steps was watched.
    """
    time, timestep = part["time"].values, float(trace.attrs["timestep"])
    apart = np.diff(time)
    if not expectation.reads_samples or not len(apart) or apart.max() < 1.5 * timestep:
        return ""
    known = set(trace["watch"].values.tolist()) if "watch" in trace else set()
    (start, end), every = expectation.window_in(end_of(trace)), trace["time"].values
    ends = [first_step(start, timestep) * timestep, every[-1] if end is None else end]
    at_ends = all(np.abs(every - moment).min() < timestep for moment in ends)
    if expectation.watches and at_ends and {watch.label for watch in expectation.watches} <= known:
        return ""
    return f"; at samples of {np.median(apart):.6g} s"


def _unseen(found: Judgment, words: str) -> Judgment:
    """What did not hold because it was not seen."""
    return found._replace(held=False, near_miss=False, value=None, margin=None, words=words, unknown=True)


def verdict_lines(verdicts: Iterable[Verdict]) -> list[str]:
    """The verdicts as a table for a terminal: held or not, subject, demand, and what was found."""
    rows = [(mark(one), one.metric, one.demanded, one.found) for one in verdicts]
    return [f"  {line}" for line in aligned(rows)]


def mark(verdict: Verdict) -> str:
    """How a verdict counts, in a word."""
    if verdict.skip:
        return "skip"
    if verdict.xfail:
        return "xfail" if verdict.passed else "XPASS" if verdict.held else "FAIL"
    return "pass" if verdict.passed else "FAIL"
