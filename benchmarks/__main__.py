"""`make bench`: prints a table of paired ratios on this machine, and writes it as JSON."""

from __future__ import annotations

import json
import os
import platform
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "disable")

from benchmarks import watch  # noqa: E402
from benchmarks.loop import measure  # noqa: E402

NO_NOISE = "sensing={}"
UNTIL_FAR = ["expect=[]"]
CASES = {
    "n = 5, plane, no noise": ("paper/case1_2d", [NO_NOISE, *UNTIL_FAR]),
    "n = 5, plane, noise": ("paper/case1_2d", UNTIL_FAR),
    "n = 5, plane, 4 obstacles, no noise": ("main", [NO_NOISE, *UNTIL_FAR]),
    "n = 5, plane, 4 obstacles, noise": ("main", UNTIL_FAR),
    "n = 6, space, no noise": ("paper/case1_3d", [NO_NOISE, *UNTIL_FAR]),
    "n = 6, space, noise": ("paper/case1_3d", UNTIL_FAR),
}


def main() -> None:
    """Measures every case."""
    print(f"{'case':38s} {'bare':>8s} {'native':>8s} {'twin':>8s} {'native/bare':>12s} {'twin/bare':>10s}")
    found = {}
    for name, (scenario, overrides) in CASES.items():
        row = found[name] = measure(scenario, overrides)
        print(
            f"{name:38s} {row['bare']:5.2f} us {row['native']:5.2f} us {row['twin']:5.0f} us"
            f" {row['native/bare']:12.2f} {row['twin/bare']:10.0f}"
        )
    watched = watch.main()
    path = Path("renders") / "benchmarks.json"
    path.parent.mkdir(exist_ok=True)
    path.write_text(
        json.dumps({"machine": platform.platform(), "cases": found, "watch": watched}, indent=2) + "\n"
    )
    print(f"wrote {path}")


if __name__ == "__main__":
    main()
