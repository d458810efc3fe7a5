"""What measures other simulators: adapters in other processes, and our own loop on their mission."""

import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.peers import MODES, stage, tables
from benchmarks.peers.compare import HERE
from benchmarks.peers.environments import REQUIREMENTS
from benchmarks.peers.flight import timed
from benchmarks.peers.ours import fly, mission
from benchmarks.peers.remote import Failed, Remote
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build

ADAPTER = f"""
import sys
print("a library greets")
sys.path.insert(0, {str(HERE)!r})
from flight import Flight, serve

def fly(mode, n):
    if mode == "broken":
        raise ValueError("no such mission")
    steps = [0]
    def step(count):
        print("a library chatters")
        steps[0] += count
    return Flight(step, lambda: float(steps[0]), 0.1, 2 * n, "7.0", 3)

serve(fly)
"""


@pytest.fixture
def adapter(tmp_path: Path) -> Path:
    path = tmp_path / "adapter.py"
    path.write_text(ADAPTER)
    return path


def test_an_adapter_takes_the_steps_it_is_asked_for(adapter: Path) -> None:
    with Remote(Path(sys.executable), adapter, "well", 4) as peer:
        assert (peer.timestep, peer.robots, peer.version, peer.chunk) == (0.1, 8, "7.0", 3)
        assert min(peer.timed(3)) >= 0.0
        peer.timed(6)
        assert peer.error == 9.0


def test_an_adapter_that_fails_says_why(adapter: Path) -> None:
    with pytest.raises(Failed, match="ValueError: no such mission"):
        Remote(Path(sys.executable), adapter, "broken", 4)


def test_every_mode_has_its_adapter_and_its_environment() -> None:
    for mode in MODES:
        assert (HERE / f"fly_{mode.peer}.py").is_file()
        assert mode.peer in REQUIREMENTS


def test_a_peer_that_does_not_install_has_its_reason_in_the_table() -> None:
    row = {"mode": MODES[0].title, "n": 5, "rigid": True, "why": "no wheel for this machine"}
    assert f"| {MODES[0].title} | 5 | no wheel for this machine |" in tables([row])["peers"]


@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("n", [5, 50, 500])
def test_places_are_on_the_sphere_apart_and_clear_of_obstacles(n: int, axes: int) -> None:
    places = stage.places(n, axes)
    np.testing.assert_allclose(np.linalg.norm(places, axis=1), stage.radius(n, axes))
    gaps = np.linalg.norm(places[:, None] - places, axis=2) + 9.0 * np.eye(n)
    assert gaps.min() > 4.0 * stage.RADIUS
    for t in np.linspace(0.0, 2.0 * np.pi * stage.SWEEP / stage.SPEED, 60):
        reach = np.linalg.norm(stage.obstacles(n, axes) - stage.target(t, n, axes)[0], axis=1)
        assert reach.min() > stage.radius(n, axes) + stage.RADIUS + stage.OBSTACLE_RADIUS


def test_the_target_has_the_velocity_it_is_said_to_have() -> None:
    before, after = (stage.target(t, 5, 3)[0] for t in (2.0, 2.0 + 1e-6))
    np.testing.assert_allclose((after - before) / 1e-6, stage.target(2.0, 5, 3)[1], atol=1e-6)


def test_our_robots_keep_their_places(compiled: None) -> None:
    world = build(mission("point_mass", 5, 2))
    own = fly(world)
    with native_loop(world):
        timed(own, 2000)
    assert own.error() < 0.02
