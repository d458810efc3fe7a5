"""What an interrupted command says: what it has left, and how to go on."""

from pathlib import Path

import pytest

from escort_mj.cli.runs import _interrupted, draw
from escort_mj.files import identify, write_json
from escort_mj.stopping import Interrupted

HERE = Path("here")
AGAIN = [(None, False, ", beside it"), (HERE, False, ", in its place with --overwrite"), (HERE, True, "")]


@pytest.mark.parametrize(("out", "overwrite", "where"), AGAIN)
def test_the_command_that_makes_a_run_again(
    tmp_path: Path, out: Path | None, overwrite: bool, where: str
) -> None:
    outcome = {"outcome": "interrupted", "message": "at 1 s", "simulated_time": 1.0}
    write_json(tmp_path / "outcome.json", identify() | outcome)
    told = f"holds the run up to then: at 1 s; the same command makes the run from its start{where}"
    assert _interrupted(tmp_path, out, overwrite).endswith(told)


def test_whatever_is_drawn_is_complete_before(tmp_path: Path) -> None:
    def interrupt(folder: Path) -> list[Path]:
        raise KeyboardInterrupt

    with pytest.raises(Interrupted, match="the run is complete; escort-mj render .* draws it"):
        draw(tmp_path, interrupt, False, False)
