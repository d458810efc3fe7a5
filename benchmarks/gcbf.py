"""`python -m benchmarks.gcbf`: the shipped worlds of GCBF+, and drawn ones, as docs/gcbf.md."""

from __future__ import annotations

import os
from collections.abc import Iterator

os.environ.setdefault("MUJOCO_GL", "disable")

from benchmarks.document import publish, table, wants_docs  # noqa: E402
from escort_mj.api.benchmarks import gcbf  # noqa: E402
from escort_mj.study.benchmark.gcbf import Benchmark  # noqa: E402
from escort_mj.study.sweeps.statistics import Proportion  # noqa: E402

PAGE = "gcbf.md"
IN_SPACE = ("LinearDrone", "CrazyFlie")
HEAD = ["worlds", "agents", "controller", "episodes", "safe", "reach", "success", "fastest [m/s]"]


def percent(share: Proportion) -> str:
    """A share with its interval."""
    low, high = (100.0 * bound for bound in share.interval)
    return f"{100.0 * share.share:.1f} ({low:.1f} to {high:.1f})"


def rows(found: Benchmark) -> Iterator[list[str]]:
    """Ours, then the others."""
    about, limit = [found.worlds.environment, str(found.worlds.robots)], found.worlds.speed_limit_per_axis
    shares = [percent(each) for each in (found.safe, found.reach, found.success)]
    fastest = max(row.speed_per_axis for row in found.rows)
    yield [*about, "here", str(len(found.rows)), *shares, f"{fastest:.2f}"]
    for peer in found.peers:
        known = ["" if each is None else f"{each:.1f}" for each in (peer.safe, peer.reach, peer.success)]
        yield [*about, peer.name, str(peer.episodes), *known, f"{limit:.2f}"]


def main() -> None:
    """Flies all worlds."""
    docs = wants_docs(__doc__, PAGE)
    found = [gcbf(name, progress=False) for name in ("n8", "n32")]
    found += [
        gcbf(agents=8, area=2.0, episodes=32, seed=5, environment=name, progress=False) for name in IN_SPACE
    ]
    publish(PAGE, {"gcbf": table(HEAD, (row for each in found for row in rows(each)))}, docs)


if __name__ == "__main__":
    main()
