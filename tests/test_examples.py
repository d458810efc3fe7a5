"""The examples run as they are."""

import contextlib
import importlib.util
import io
import json
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import matplotlib
import numpy as np
import pytest

import escort_mj
from escort_mj import Controller
from tests import ros_stand_in

EXAMPLES = Path(__file__).parents[1] / "examples"


def example(name: str) -> Any:
    """The module of an example."""
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
def test_many_missions(compiled: None) -> None:
    made = subprocess.run(
        [sys.executable, EXAMPLES / "many_missions.py", "3"], capture_output=True, text=True, check=True
    )
    assert " of 3 missions passed; least clearance 0." in made.stdout
    assert made.stderr.splitlines() == ["1 of 3 missions", "2 of 3 missions", "3 of 3 missions"]


def test_ros2_node_without_ros2() -> None:
    made = subprocess.run([sys.executable, EXAMPLES / "ros2_node.py"], capture_output=True, text=True)
    assert made.returncode == 1
    assert made.stderr.startswith("No module named 'rclpy'; source the setup of ROS 2 first")


@pytest.mark.slow
def test_train_policy(compiled: None, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("cmaes")
    pytest.importorskip("gymnasium")
    curve = example("train_policy").main(2, duration=0.5)
    assert len(curve) == 2 and np.isfinite(curve).all()
    assert "trained: " in capsys.readouterr().out


@pytest.mark.slow
def test_train_ppo(
    compiled: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("stable_baselines3")
    trainer = example("train_ppo")
    monkeypatch.setattr(trainer, "MISSIONS", 2)
    monkeypatch.setattr(trainer, "SEEDS", range(1000, 1002))
    trainer.main(1, tmp_path)
    printed = capsys.readouterr().out
    assert "paper's behaviors: 2 of 2 missions passed" in printed and "policy: " in printed


def test_udp_robots(tmp_path: Path) -> None:
    """In real time, so on a busy machine some answers may come late."""
    found = example("udp_robots").fly(seconds=0.4, log=tmp_path / "log.csv")
    assert found["messages"] >= 20 and found["missed"] < 20 and found["latency_median_ms"] > 0.0
    head, *rows = (tmp_path / "log.csv").read_text().splitlines()
    names = [f"robot_{number}" for number in (1, 2, 3, 4)]
    assert head.split(",") == [
        *("time", *(f"{name}.{axis}" for name in names for axis in "xy")),
        *(f"{name}.v{axis}" for name in names for axis in "xy"),
        *(f"{name}.f{axis}" for name in names for axis in "xy"),
        *("target.x", "target.y"),
    ]
    times = np.array([float(row.split(",")[0]) for row in rows])
    assert len(times) >= 5 and (np.diff(times) > 0.0).all() and times[-1] < 0.4
    run = escort_mj.judge(tmp_path / "log.csv", escort_mj.load_scenario("fifty_hertz", {"expect": []}))
    assert run.passed and run.trace.q[0].values.tolist() == Controller("fifty_hertz").start.tolist()
    if found["steps_braking"] == 0:
        assert (found["last_radii"] < [2.68, 2.68, 2.7, 2.7]).all(), "they have come closer"


def test_robots_without_a_command_brake() -> None:
    module = example("udp_robots")
    robots = module.Robots([[0.0, 0.0]], [2.0], [4.0], 0.02)
    robots.command(np.array([[4.0, 0.0]]))
    speeds = [0.0]
    for _ in range(60):
        robots.step()
        speeds.append(robots.v[0, 0])
    assert np.argmax(speeds) == 6 and speeds[6] == pytest.approx(0.24), "100 ms after the last command"
    assert robots.brakes == 54 and abs(speeds[-1]) < 0.01 * speeds[6]


@pytest.mark.parametrize("command", ["twist", "wrench"])
def test_ros2_node(command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """With a stand-in for ROS 2: what the robots are sent is what the controller says, in their own axes."""
    ros_stand_in.install(monkeypatch)
    monkeypatch.setattr(ros_stand_in.Node, "parameters", {"command": command})
    module = example("ros2_node")
    node, controller = module.Escort(), Controller("fifty_hertz")
    topic, part = ("wrench", "force") if command == "wrench" else ("cmd_vel", "linear")
    q, v = controller.start, np.full((4, 2), 0.3)
    target = np.array([0.2, -0.1]), np.array([0.1, 0.2])

    def tell(name: str, place: np.ndarray, speed: np.ndarray, yaw: float) -> None:
        message = ros_stand_in.Odometry()
        at, turned = message.pose.pose.position, message.pose.pose.orientation
        at.x, at.y = place
        turned.w, turned.z = np.cos(yaw / 2), np.sin(yaw / 2)
        inward = np.exp(-1j * yaw) * (speed[0] + 1j * speed[1])
        message.twist.twist.linear.x, message.twist.twist.linear.y = inward.real, inward.imag
        node.listens[f"/{name}/odom"](message)

    node.tick()
    assert not any(node.sent.values()) and node.period == 0.02, "it waits until it has heard of every robot"
    controller.reset(q, target[0])

    def step_on(number: int, *silent: int) -> None:
        node.nanoseconds = number * 20_000_000
        tell("target", *target, 0.3)
        for row in range(4):
            if row not in silent:
                tell(f"robot_{row + 1}", q[row], v[row], 0.5 * row)
        node.tick()

    def last(row: int) -> complex:
        sent = getattr(node.sent[f"/robot_{row + 1}/{topic}"][-1], part)
        assert sent.z == 0.0
        return np.exp(0.5j * row) * (sent.x + 1j * sent.y)

    for number in range(1, 4):
        step_on(number)
        force = controller(0.02 * number, q, v, target)
        expected = force if command == "wrench" else controller.velocity
        for row in range(4):
            assert [last(row).real, last(row).imag] == pytest.approx(expected[row], abs=1e-9)
    assert node.warnings == []
    for number in range(4, 26):
        step_on(number, 2)
    assert (
        len(node.warnings) == 1 and "robot 3: its last usable measurement is 0.12 s old" in node.warnings[0]
    )
    assert abs(last(2)) < 1.0 and abs(last(0)) > 1e-3, "the others go on"
    node.nanoseconds += 200_000_000
    node.tick()
    node.tick()
    assert len(node.warnings) == 2 and "all robots stop: time: found" in node.warnings[1]
    for number in range(37, 137):
        node.nanoseconds = number * 20_000_000
        node.tick()
    assert max(abs(last(row)) for row in range(4)) < 1e-3, "no odometry, no force"
    node.stop()
    assert node.controller.stopped and len(node.warnings) == 2


LONG = {"many_seeds"}
BOOKS = [
    pytest.param(path, id=path.stem, marks=[pytest.mark.slow] if path.stem in LONG else [])
    for path in sorted(EXAMPLES.glob("*.ipynb"))
]


@pytest.mark.parametrize("path", BOOKS)
def test_a_notebook_runs_and_prints_what_it_shows(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, compiled: None
) -> None:
    book = json.loads(path.read_text(encoding="utf-8"))
    matplotlib.use("agg")
    monkeypatch.setattr("matplotlib.pyplot.show", lambda: None)
    monkeypatch.chdir(tmp_path)
    names: dict = {"__name__": "__main__"}
    shown, now = [], io.StringIO()
    with contextlib.redirect_stdout(now):
        for cell in book["cells"]:
            if cell["cell_type"] == "code":
                exec(compile("".join(cell["source"]), path.name, "exec"), names)
                shown += [text for output in cell["outputs"] for text in output.get("text", ())]
    assert words(now.getvalue()) == words("".join(shown))
    pictures = [output for cell in book["cells"] for output in cell.get("outputs", ()) if "data" in output]
    assert any("image/png" in picture["data"] for picture in pictures)


def words(text: str) -> str:
    """Text without its digits: they depend on the processor."""
    return re.sub(r"[\d.]+", "#", text)


@pytest.mark.slow
def test_train_both_sides(
    compiled: None, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    trainer = example("train_both_sides")
    for name, few in (("POPULATION", 3), ("ELITES", 2), ("TRIALS", 2), ("LAWS", {"guard": ["guard"]})):
        monkeypatch.setattr(trainer, name, few)
    trainer.main([*"--generations 1 --missions 1 --tests 2 --folder".split(), str(tmp_path)])
    found = json.loads((tmp_path / "curve.json").read_text())
    assert [*found["table"]] == ["first", "trained", "guard"] and len(found["curve"]) == 2
    with np.load(tmp_path / "intruder.npz") as network:
        assert network["weights_1"].shape == (2, 22)
    assert "trained: first intruder" in capsys.readouterr().out


def test_minari_dataset(compiled: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    minari = pytest.importorskip("minari")
    pytest.importorskip("gymnasium")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    (tmp_path / "short.yaml").write_text("name: short\nduration: 0.2\ntarget: {position: [0, 0]}\n")
    example("minari_dataset").record(str(tmp_path / "short.yaml"), "escort_mj/short-v0", 2)
    found = minari.load_dataset("escort_mj/short-v0")
    assert found.total_episodes == 2 and found.total_steps == 20
    for episode in found.iterate_episodes():
        assert episode.truncations.tolist() == [False] * 9 + [True] and not episode.terminations.any()
        assert all(one in found.observation_space for one in episode.observations)
    assert found.recover_environment().reset(seed=1)[0] in found.observation_space


def test_dm_env_suite(compiled: None) -> None:
    dm_env = pytest.importorskip("dm_env")
    environment = example("dm_env_suite").Escort(
        escort_mj.load_scenario("main", {"duration": 0.6, "expect": []})
    )
    action, observation = environment.action_spec(), environment.observation_spec()
    step = environment.step(action.generate_value())
    assert step.step_type is dm_env.StepType.FIRST
    steps = 0
    while not step.last():
        step, steps = environment.step(np.ones(action.shape, action.dtype)), steps + 1
        observation.validate(step.observation)
    assert steps == 30 and step.discount == 1.0
    assert environment.step(action.generate_value()).first()


def test_mujoco_viewer(compiled: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a window: a stand-in for MuJoCo's viewer sees the bodies where the run had them."""
    scenario = escort_mj.load_scenario("main", {"duration": 0.1, "expect": []})
    run = escort_mj.run(scenario, tmp_path / "run", figures=False, video=False)
    run.export(tmp_path / "run.npz")
    seen = []

    class Window(contextlib.nullcontext):
        def __init__(self, model: Any, data: Any) -> None:
            super().__init__(self)
            self.data = data

        def sync(self) -> None:
            seen.append(self.data.body("robot_1").xpos[:2].copy())

    viewer = SimpleNamespace(launch_passive=Window)
    monkeypatch.setitem(sys.modules, "mujoco.viewer", viewer)
    monkeypatch.setattr("mujoco.viewer", viewer, raising=False)
    monkeypatch.setattr(sys, "argv", ["mujoco_viewer.py", str(tmp_path / "run.npz")])
    example("mujoco_viewer")
    np.testing.assert_allclose(seen, run.trace["q"].values[:, 0], atol=1e-9)
