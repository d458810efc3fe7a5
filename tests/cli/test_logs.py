import json

import pandas

from tests.test_cli import call

SCENARIO = """\
name: still
duration: 1
robots: {positions: [[3, 0], [-3, 0]]}
mission: {radius: 3}
expect: [{metric: radius_error_max, at_most: 0.1}, {metric: force_rms, at_most: 1}]
"""


def test_exit_codes_and_counts(monkeypatch, capfd, tmp_path, compiled):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "still.yaml").write_text(SCENARIO)
    times = [k / 20 for k in range(21)]
    table = pandas.DataFrame({"time": times, "a.x": 3.0, "a.y": 0.0, "robot_2.x": -3.0, "robot_2.y": 0.0})
    table.to_csv("good.csv", index=False)
    table.assign(**{"robot_2.x": -3.5}).to_csv("bad.csv", index=False)
    usual = ("--scenario", "still.yaml", "--map", "robot_1=a", "--no-figures")
    code, out, _ = call(monkeypatch, capfd, "judge", "good.csv", *usual)
    assert code == 0 and "2 of 2 verdicts passed; 1 not judged" in out
    assert "skip  force_rms" in out and "not judged: the log does not contain effort" in out
    assert (tmp_path / "renders" / "good" / "trace.nc").is_file()
    code, out, _ = call(monkeypatch, capfd, "judge", "bad.csv", *usual, "--json")
    told = json.loads(out)
    assert code == told["exit_code"] == 1 and told["not_judged"] == 1 and told["folder"] == "renders/bad"
    assert [one["passed"] for one in told["verdicts"]] == [True, False, True]
    code, _, err = call(monkeypatch, capfd, "judge", "good.csv", "--scenario", "still.yaml")
    assert code == 2 and "column a.x: a is not a robot" in err
    assert [line.split(": ")[0] for line in err.splitlines()] == ["good.csv", "good.csv"]  # one line each
    code, _, err = call(monkeypatch, capfd, "judge", "good.csv", *usual, "--map", "robot_1=b")
    assert code == 2 and "robot_1 is named twice, a and b" in err


def test_what_nobody_could_judge_is_no_pass(monkeypatch, capfd, tmp_path, compiled):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "still.yaml").write_text(SCENARIO)
    times = [k / 20 for k in range(21)]
    places = {"robot_1.x": 3.0, "robot_1.y": 0.0, "robot_2.x": -3.0, "robot_2.y": 0.0}
    pandas.DataFrame({"time": times, **places}).to_csv("log.csv", index=False)

    def code(*more):
        return call(
            monkeypatch, capfd, "judge", "log.csv", "--scenario", "still.yaml", "--no-figures", *more
        )[0]

    force = "{metric: force_rms, at_most: 1"
    assert code() == 0 and code("--strict") == 1
    assert code("--set", f"expect=[{force}}}, {{sanity: all}}]") == 1
    told = json.loads((tmp_path / "renders" / "log-3" / "verdicts.json").read_text())
    assert "judged at least 1 expectation: 0 of 2" in str(told)
    skipped = f"expect=[{force}, skip: no motors were logged}}]"
    assert code("--set", skipped) == 0 and code("--set", skipped, "--strict") == 0
    assert code("--set", "expect=[]", "--strict") == 0
