"""Radios of plugins: both forms, the bits of one that ships, and wrong ones."""

from pathlib import Path

import pytest

from escort_mj import Run, load_scenario, run
from escort_mj.conformance import check_plugin
from escort_mj.radios import RADIOS, Radio, radio
from tests.plugged import plugin

FADING, SCENARIO = plugin("radio")
COMPILED = '    radio: Literal["own"] = "own"\n    compiled: ClassVar[bool] = True\n'
HEARD = ("q", "messages_sent", "messages_heard", "messages_lost", "heard_from", "target_estimate")


def flown(folder: Path, text: str, *changes: str) -> Run:
    (folder / "own.py").write_text(text)
    (folder / "own.yaml").write_text(SCENARIO)
    return run(load_scenario(folder / "own.yaml", changes))


def bits(found: Run) -> list[bytes]:
    return [found.trace[name].values.tobytes() for name in HEARD]


@pytest.mark.slow_cases("Periodic")
@pytest.mark.parametrize("kind", RADIOS)
def test_what_ships_is_a_plugin_with_the_same_text(compiled: None, tmp_path: Path, kind: type[Radio]) -> None:
    """The file itself, with the name changed, compiled and in Python: the same bits."""
    name = kind.model_fields["radio"].default
    text = (Path(radio.__file__).parent / f"{name}.py").read_text()
    text = text.replace(f'"{name}"', '"own"').replace("escort_mj.radios.radio", "escort_mj.plugins")
    shipped = bits(flown(tmp_path, text, f"communication.radio={name}"))
    assert bits(flown(tmp_path, text)) == shipped
    assert bits(flown(tmp_path, text.replace('    radio: Literal["own"] = "own"\n', COMPILED))) == shipped


@pytest.mark.slow
def test_numbers_of_its_own_and_a_distance(compiled: None, tmp_path: Path) -> None:
    found = flown(tmp_path, FADING)
    lost, heard = (found.trace[name].values[-1].sum() for name in ("messages_lost", "messages_heard"))
    assert 0.2 < lost / (lost + heard) < 0.5
    text = FADING.replace('    radio: Literal["own"] = "own"\n', COMPILED)
    assert bits(flown(tmp_path, text)) == bits(found)
    none = flown(tmp_path, text, "communication.decay=null")
    assert none.trace["messages_lost"].values.max() == 0.0, "null is no limit"
    slow = text.replace("def loses", "def delays(self, r):\n        return 0.07\n\n    def loses")
    later = flown(tmp_path, slow)
    assert later.trace["messages_heard"].values.max() == 0.0, "what takes more than longest is lost"


@pytest.mark.slow  # docs/plugins.md has a radio whose checks are run each time
def test_it_passes_its_checks(compiled: None, tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(FADING)
    wrong = [check for check in check_plugin(str(tmp_path / "own.py")) if not check.held]
    assert not wrong
