import json

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
    code, _, err = call(monkeypatch, capfd, "gains", "main", "--set", "controller=terminal_smc")
    assert code == 2 and "no rule for law terminal_smc" in err
