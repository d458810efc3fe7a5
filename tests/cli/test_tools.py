import json

from escort_mj.conformance.checking import Check
from escort_mj.metrics.metric import Metric
from escort_mj.scenario.kinds import KINDS
from tests.test_cli import call


def test_gains_are_proposed(monkeypatch, capfd):
    code, out, _ = call(monkeypatch, capfd, "gains", "robots/quadrotor", "--json")
    told = json.loads(out)
    assert code == 0 and told["limited_by"] == "the drive" and told["gains"]["derivative_gain"] == 4.1
    code, out, _ = call(monkeypatch, capfd, "gains", "main", "--set", "controller=asmc")
    assert code == 0 and "limited by noise" in out and "switching_gain    80        10" in out
    code, out, _ = call(monkeypatch, capfd, "gains", "pursuit/two_laws", "--json")
    told = json.loads(out)
    assert code == 0 and (told["law"], told["teams"]["south"]["law"]) == ("apd_smc", "pd")


def test_each_component_is_listed_once_under_its_kind(monkeypatch, capfd, tmp_path):
    (tmp_path / "far.py").write_text(
        "from escort_mj.plugins import metric\n"
        '@metric(unit="m")\ndef far(trace):\n    """Return how far."""\n    return 1.0\n'
    )
    code, out, _ = call(monkeypatch, capfd, "list", "--json", "--plugin", str(tmp_path / "far.py"))
    told = {kind: [entry["name"] for entry in entries] for kind, entries in json.loads(out)["found"].items()}
    assert code == 0 and told["failures"] == ["dead", "mad", "stuck"] and "robots_lost" in told["rules"]
    assert "far" in told["metrics"] and not {*told["failures"]} & {*told["robots"]}
    for base, members in KINDS.items():
        plural = getattr(base, "plural", "metrics")
        assert len({*told[plural]}) == len(members) + (base is Metric), plural


def test_what_a_plugin_is_not_is_told_with_exit_code_1(monkeypatch, capfd):
    found = [Check("far", "loads", True, "it does"), Check("far", "numbers", False, "it gives words")]
    monkeypatch.setattr("escort_mj.conformance.apart.check_apart", lambda plugin: found)
    code, out, _ = call(monkeypatch, capfd, "check-plugin", "far.py", "--quiet")
    assert code == 1 and out == "  NO  far  numbers              it gives words\n"
    del found[1]
    assert call(monkeypatch, capfd, "check-plugin", "far.py", "--quiet") == (0, "", "")
