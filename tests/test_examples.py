"""The examples run as they are."""

import subprocess
import sys
from pathlib import Path

EXAMPLES = Path(__file__).parents[1] / "examples"


def test_many_missions(compiled: None) -> None:
    made = subprocess.run(
        [sys.executable, EXAMPLES / "many_missions.py", "3"], capture_output=True, text=True, check=True
    )
    assert " of 3 missions passed; least clearance 0." in made.stdout
