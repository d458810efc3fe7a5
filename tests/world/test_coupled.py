"""Payloads and tethers: what couples a robot of a file to something else is refused by name."""

from pathlib import Path

import pytest

from escort_mj.errors import ScenarioError
from escort_mj.robots.mjcf import Mjcf
from escort_mj.robots.modeled import known
from escort_mj.scenario.reader.load import load_file
from tests.corpus import missions

ROBOT = Path(__file__).with_name("coupled.xml").read_text()
PARCEL, BALL = "parcel (0.5278 kg)", "x (4.189 kg)"
MISSIONS = missions(__file__)
TENDONS = {
    "a spring": ('<site site="top"/><site site="ring"/>', f"the tendon ties it to {PARCEL}"),
    "a tether": ('<site site="hook"/><site site="top"/>', "the tendon ties it to the world"),
}


def refusal(tmp_path: Path, **parts: str) -> str:
    """What a scenario with a robot says of it; empty where it is taken."""
    (tmp_path / "r.xml").write_text(ROBOT.format(**{"assets": "", "inside": "", "rest": ""} | parts))
    (tmp_path / "m.yaml").write_text("robots: {count: 2, kind: {kind: mjcf, file: r.xml}}\nduration: 1\n")
    try:
        load_file(tmp_path / "m.yaml")
    except ScenarioError as error:
        (fault,) = error.faults
        assert (fault.key, fault.line) == ("robots.kind", 1)
        return fault.message
    return ""


@pytest.mark.parametrize("case", MISSIONS["coupled"])
def test_what_a_robot_is_coupled_to_is_named(tmp_path: Path, case: str) -> None:
    equality, words = MISSIONS["coupled"][case]
    said = refusal(tmp_path, rest=f"<equality>{equality}</equality>")
    assert said.startswith(f"r.xml: {words}. A mission takes the body base with all in it"), said


@pytest.mark.parametrize("case", TENDONS)
def test_so_is_what_a_tendon_leads_to(tmp_path: Path, case: str) -> None:
    path, words = TENDONS[case]
    rest = f'<tendon><spatial stiffness="5">{path}</spatial></tendon>'
    assert refusal(tmp_path, rest=rest).startswith(f"r.xml: {words}. ")


@pytest.mark.parametrize("case", MISSIONS["apart"])
def test_what_lies_beside_it_is_left(tmp_path: Path, case: str) -> None:
    assert refusal(tmp_path, rest=MISSIONS["apart"][case]) == ""


def test_a_payload_in_the_base_is_taken(tmp_path: Path) -> None:
    """A child without a joint, or with a joint and a weld, takes part with its mass."""
    fixed = '<body name="box" pos="0 0 0.2"><geom size="0.05" mass="0.7"/></body>'
    assert refusal(tmp_path, inside=fixed) == ""
    kind = Mjcf(file=str(tmp_path / "r.xml"))
    assert known(kind.source(1.0, 1.0)).mass == pytest.approx(8.7)
    held = fixed.replace("<geom", '<joint type="ball"/><geom')
    (tmp_path / "two").mkdir()
    assert (
        refusal(tmp_path / "two", inside=held, rest='<equality><weld body1="base" body2="box"/></equality>')
        == ""
    )
    model = known(Mjcf(file=str(tmp_path / "two" / "r.xml")).source(1.0, 1.0))
    assert model.mass == pytest.approx(8.7) and [each.tag for each in model.sections["equality"]] == ["weld"]


def test_attached_models_are_refused(tmp_path: Path) -> None:
    said = refusal(tmp_path, assets='<asset><model name="g" file="g.xml"/></asset>')
    assert said.startswith("r.xml: attaches the model g.xml; expected one model: ")
