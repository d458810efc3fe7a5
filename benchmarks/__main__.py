"""`make bench`: measures speed as paired ratios on this machine; prints tables, and writes them as JSON.

`make bench ARGS="loop watch"` measures some sections only, and keeps what the JSON has of the others.
`make bench ARGS="--docs"` puts the tables into docs/performance.md as well.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from benchmarks import batch, environments, growth, loop, machine, peers, profile, recording, start, watch
from benchmarks.document import DOCS, publish
from benchmarks.peers.environments import REQUIREMENTS

PAGE = "performance.md"
FOUND = Path("renders") / "benchmarks.json"
SECTIONS = {
    "loop": loop,
    "growth": growth,
    "profile": profile,
    "watch": watch,
    "recording": recording,
    "start": start,
    "batch": batch,
    "environments": environments,
    "peers": peers,
}


def main(arguments: Any = None) -> None:
    """Measures the sections asked for, all if none is named."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("sections", nargs="*", metavar="SECTION", help=f"of {', '.join(SECTIONS)}; else all")
    parser.add_argument("--docs", action="store_true", help=f"write the tables into docs/{PAGE}")
    parser.add_argument(
        "--python",
        action="append",
        default=[],
        type=_interpreter,
        metavar="PEER=PATH",
        help=f"an interpreter that has a peer: {', '.join(REQUIREMENTS)}",
    )
    asked = parser.parse_args(arguments)
    if unknown := set(asked.sections) - set(SECTIONS):
        parser.error(f"{', '.join(sorted(unknown))}: expected {', '.join(SECTIONS)}")
    peers.PYTHONS.update(asked.python)
    found = json.loads(FOUND.read_text()) if FOUND.exists() and asked.sections else {}
    FOUND.parent.mkdir(exist_ok=True)
    for name in asked.sections or SECTIONS:
        rows, by = SECTIONS[name].measure(), machine.describe()
        found[name] = {"machine": by, "rows": rows}
        FOUND.write_text(json.dumps(found, indent=2) + "\n")
        publish(PAGE, SECTIONS[name].tables(rows), asked.docs)
        if asked.docs and hasattr(SECTIONS[name], "draw"):
            SECTIONS[name].draw(rows, DOCS / "figures")
    publish(PAGE, machine.tables(machine.describe()), asked.docs)
    print(f"wrote {FOUND}")


def _interpreter(text: str) -> tuple[str, Path]:
    """A peer and the interpreter of an environment that has it."""
    peer, _, path = text.partition("=")
    if peer not in REQUIREMENTS or not Path(path).is_file():
        raise argparse.ArgumentTypeError(f"{text}: expected PEER=PATH, PEER of {', '.join(REQUIREMENTS)}")
    return peer, Path(path)


if __name__ == "__main__":
    main()
