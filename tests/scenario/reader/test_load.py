from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from escort_mj.errors import ScenarioError, UsageError
from escort_mj.scenario import Scenario, load_file, parse_scenario
from escort_mj.scenario.reader.shipped import load_scenario, study_path

GOOD = """\
name: good
duration: 20
axes: 2
target:
  position: ["3 + 0.1*t", 0]
robots:
  positions: [[8, 0], [-2, 0], [3, 5]]
obstacles:
  - {position: [15, 6], radius: 0.3}
mission:
  behaviors: [avoid_obstacles, {behavior: chords, gain: 0.5}, surface]
controller:
  law: apd_smc
expect:
  - {metric: contacts, at_most: 0}
"""


def faults(text: str, **kwargs) -> list[str]:
    """The faults of a text, each as line:column: key: message."""
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(text, "s", **kwargs)
    assert caught.value.exit_code == 2
    return [str(fault).removeprefix("s:") for fault in caught.value.faults]


def test_good_scenario():
    scenario = parse_scenario(GOOD)
    assert scenario.name == "good"
    assert scenario.robots.positions == ((8.0, 0.0), (-2.0, 0.0), (3.0, 5.0))
    assert scenario.target.position == ("3 + 0.1*t", 0.0)
    assert [behavior.behavior for behavior in scenario.mission.behaviors] == [
        "avoid_obstacles",
        "chords",
        "surface",
    ]


def test_short_scenarios_are_valid():
    assert parse_scenario("name: five") == Scenario(name="five")
    assert parse_scenario("controller: asmc").controller.law == "asmc"
    assert parse_scenario("controller: {slope: 10}").controller.law == "apd_smc"


def test_everything_wrong_at_once_in_the_order_of_the_file():
    found = faults(
        "axes: 3\nvideo: {witdh: 3}\nrobots: {mass: -1, kind: 3}\nrecording: {rate: 60}\n"
        "expect: [{metric: contacts}]\ntarget: {position: [1, 2]}\n"
    )
    assert [fault.split(": ")[:2] for fault in found] == [
        ["2:9", "video.witdh"],
        ["3:16", "robots.mass"],
        ["3:26", "robots.kind"],
        ["4:19", "recording.rate"],
        ["5:10", "expect[0]"],
        ["6:20", "target.position"],
    ]
    # The size of the trace is known once robots are.
    found = faults("axes: 3\nvideo: {witdh: 3}\nrecording: {rate: 60}\ntarget: {position: [1, 2]}\n")
    assert [fault.split(": ")[1] for fault in found] == ["video.witdh", "recording.rate", "target.position"]


@pytest.mark.parametrize("wrong", ["robots: {cuont: 2}", "uncertainty: {x: 1}", "target: {radius: -1}"])
def test_wrong_dimensions_are_found_beside_parts_that_are_wrong_by_themselves(wrong: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(f"{wrong}\nwalls: [{{points: [[0, 0], [1]]}}]\nobstacles: [{{position: [1]}}]\n", "s")
    keys = [fault.key for fault in caught.value.faults]
    assert len(keys) == 3
    assert keys[1:] == ["walls[0].points[1]", "obstacles[0].position"]


def test_an_error_of_thousands_of_faults_stays_readable() -> None:
    with pytest.raises(ScenarioError) as caught:
        parse_scenario("robots:\n" + "  count: 3\n" * 3000, "s")
    assert len(caught.value.faults) == 2999
    assert str(caught.value).splitlines()[-1] == "... and 2979 more faults"


class TestFiles:
    def test_file(self, tmp_path: Path):
        path = tmp_path / "good.yaml"
        path.write_text("\ufeff" + GOOD)
        assert load_file(path) == load_file(str(path)) == parse_scenario(GOOD)

    def test_faults_name_the_file(self, tmp_path: Path):
        path = tmp_path / "bad.yaml"
        path.write_text("name: x\nduration: -1\n")
        with pytest.raises(ScenarioError) as caught:
            load_file(path)
        assert str(caught.value) == f"{path}:2:11: duration: found -1; expected more than 0"

    def test_missing_file(self, tmp_path: Path):
        (tmp_path / "main.yaml").write_text(GOOD)
        with pytest.raises(UsageError, match='no such file; did you mean "main.yaml"'):
            load_file(tmp_path / "mian.yaml")
        with pytest.raises(UsageError, match="no such file"):
            load_file(tmp_path / "no" / "folder.yaml")

    @pytest.mark.parametrize("name", ["a" * 100_000, "a\0b.yaml"])
    def test_a_name_that_no_file_can_have(self, name: str):
        with pytest.raises(UsageError, match="there is no such file") as caught:
            load_file(name)
        assert len(str(caught.value)) < 300

    def test_folder_and_device(self, tmp_path: Path):
        with pytest.raises(UsageError, match="not a file"):
            load_file(tmp_path)
        with pytest.raises(UsageError, match="not a file"):
            load_file("/dev/zero")

    @pytest.mark.parametrize(
        ("content", "words"),
        [
            (b"name: x\nseed: \xff\xfe\x00\n", r":2:7: found the byte 0xff; a scenario is text in UTF-8"),
            (bytes(range(256)) * 4, "this is not YAML|UTF-8"),
            (b"\x89PNG\r\n\x1a\n" + bytes(100), "UTF-8"),
            ("name: x\n".encode("utf-16"), "UTF-8"),
            (b"\x00" * 50, "this is not YAML"),
            (b"#" * 1_000_001, "more than 1000 kB"),
        ],
    )
    def test_binary(self, tmp_path: Path, content: bytes, words: str):
        path = tmp_path / "binary.yaml"
        path.write_bytes(content)
        with pytest.raises(ScenarioError, match=words) as caught:
            load_file(path)
        assert len(caught.value.faults) == 1


words = st.sampled_from(
    [*Scenario.model_fields, "position", "count", "law", "asmc", "time", "gain", "chords", "x"]
)
wild = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | words,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(words, inner, max_size=3),
    max_leaves=8,
)


@settings(max_examples=100)
@given(st.sampled_from(list(Scenario.model_fields)), wild)
def test_any_value_anywhere_is_a_scenario_or_an_error(key: str, value: object):
    try:
        parse_scenario("duration: 5", overrides={key: value})
    except ScenarioError as error:
        assert error.faults


def test_a_folder_of_that_name_hides_no_shipped_scenario(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("head_on", "studies/minute", "other"):
        (tmp_path / name).mkdir(parents=True)
    assert load_scenario("head_on").name == "head_on" and study_path("studies/minute").is_file()
    with pytest.raises(UsageError, match="other: this is not a file"):
        load_scenario("other")


@pytest.mark.parametrize(
    "file", ["plugins: [nope.py]", "robots: {masss: 2, kind: {kind: mjcf, file: nope.xml}}"]
)
def test_a_file_that_is_missing_hides_no_other_fault(tmp_path: Path, file: str) -> None:
    (path := tmp_path / "s.yaml").write_text(
        f"duration: -1\nmission: {{radius: -3}}\ncontroller: own\n{file}\n" + "target: {waypoints: no.csv}\n"
    )
    with pytest.raises(ScenarioError) as caught:
        load_file(path)
    lines = [fault.line for fault in caught.value.faults]
    own = [3] * ("robots" in file)  # a missing plugin may bring the law
    assert lines == [1, 2, *own, *[4] * (1 + len(own)), 5]


def test_of_another_version_nothing_else_is_said_though_a_plugin_is_missing() -> None:
    found = faults("version: 99\nplugins: [nope.py]\nnovel: {x: 1}\n")
    assert [fault.split(": ")[1] for fault in found] == ["version", "plugins[0]"]


def test_targets_of_teams_follow_files_of_waypoints(tmp_path: Path) -> None:
    (tmp_path / "way.csv").write_text("0,0,0\n9,3,0\n")
    teams = "[{name: n, robots: [1, 2, 3, 4, 5], targets: [{name: f, waypoints: way.csv}]}]"
    (tmp_path / "s.yaml").write_text(f"duration: 1\ntarget: null\nteams: {teams}\n")
    assert load_file(tmp_path / "s.yaml").teams[0].targets[0].waypoints[-1].time == 9.0
