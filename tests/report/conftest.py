"""Run folders made of synthetic samples: a team that closes in on a ring around a moving target."""

from __future__ import annotations

import math
import shutil
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from escort_mj import palette
from escort_mj.monitor.signals import CAUSES
from escort_mj.record.folder import RunFolder
from escort_mj.record.outcome import Outcome
from escort_mj.report.figures.drawing import style
from escort_mj.report.figures.figures import draw_figures
from escort_mj.signals import SIGNALS
from tests.synthetic import build_trace, describe, dimensions, make_verdict, pack

ROBOT, TARGET, SAFE, RADIUS = 0.3, 0.4, 1.0, 3.0
RATE = 10.0  # samples per second

ARENA = """<mujoco>
  <visual><global fovy="45" offwidth="64" offheight="64"/></visual>
  <asset><texture name="sky" type="skybox" builtin="flat" rgb1="0.9 0.9 1" width="32" height="192"/></asset>
  <worldbody>
    <light directional="true" dir="0 0 -1" diffuse="0.3 0.3 0.3"/>{bodies}
  </worldbody>
</mujoco>"""


def ball(name, position, size, color, inner=""):
    place = " ".join(f"{x:.6f}" for x in position)
    rgb = " ".join(f"{x:.4f}" for x in color)
    return (
        f'<body name="{name}" pos="{place}"{" mocap=" + repr("true") if name == "target" else ""}>{inner}'
        f'<geom type="sphere" size="{size}" mass="1" rgba="{rgb} 1" contype="0" conaffinity="0"/></body>'
    )


def model_xml(start, target, obstacles):
    count, axes = start.shape
    height = [] if axes == 3 else [ROBOT]
    bodies = [ball("target", [*target, *height], TARGET, palette.TARGET)]
    directions = np.eye(3)[:axes].astype(int)
    for i, (place, color) in enumerate(zip(start, palette.robot_colors(count), strict=True)):
        joints = "".join(
            f'<joint type="slide" axis="{x} {y} {z}" ref="{ref:.6f}"/>'
            for (x, y, z), ref in zip(directions, place, strict=True)
        )
        bodies.append(ball(f"robot_{i + 1}", [*place, *height], ROBOT, color, joints))
    for j, place in enumerate(obstacles):
        bodies.append(ball(f"obstacle_{j + 1}", [*place, *height], 0.5, palette.OBSTACLE))
    if axes == 2:
        bodies.append('<geom type="plane" size="0 0 1" rgba="0.92 0.92 0.93 1"/>')
    return ARENA.format(bodies="".join(bodies))


def motion(count, axes, samples, spread):
    """Positions (T, n, p) and target (T, p): on a ring of a shrinking (or growing) radius that turns."""
    time = np.arange(samples) / RATE
    target = np.zeros((samples, axes))
    target[:, 0] = 0.5 * time
    angle = 2 * math.pi * np.arange(count) / count + 0.1 * time[:, None]
    size = RADIUS * (1.0 + spread(time))[:, None]
    q = np.zeros((samples, count, axes))
    q[..., 0], q[..., 1] = size * np.cos(angle), size * np.sin(angle)
    if axes == 3:
        q[..., 2] = 0.4 * RADIUS * np.where(np.arange(count) % 2, 1.0, -1.0)
    return time, q + target[:, None], target


@pytest.fixture(scope="session")
def make_run(tmp_path_factory):
    """A run folder as the arguments of `write` say: of each kind one is written, others are its copies."""
    written: dict[tuple, Path] = {}

    def make(**shape) -> Path:
        if "lost" in shape:  # no key
            return write(**shape)
        key = tuple(sorted(shape.items()))
        if key not in written:
            written[key] = write(**shape)
        return Path(shutil.copytree(written[key], tmp_path_factory.mktemp("run"), dirs_exist_ok=True))

    def write(
        count=5,
        axes=2,
        samples=60,
        obstacles=2,
        spread=lambda time: np.exp(-time),
        outcome=Outcome.COMPLETED,
        title="synthetic",
        truth=None,
        lost=None,
        video="{width: 320, height: 180, rate: 10, speed: 2}",
    ) -> Path:
        time, q, target = motion(count, axes, samples, spread)
        places = np.zeros((obstacles, axes))
        places[:, 0] = 2.0 + 2.0 * np.arange(obstacles)
        places[:, 1] = np.where(np.arange(obstacles) % 2, 4.5, -4.5)
        sizes = dimensions(
            count, axes, obstacles, truth=False, known=truth is not None, judged=truth == "lyapunov"
        )
        names = [f"obstacle_{j + 1}" for j in range(obstacles)]
        labels = describe(
            sizes,
            obstacles=names,
            bodies=[*(f"robot_{i + 1}" for i in range(count)), "target", *names, "floor"],
            body_thickness=[2 * ROBOT] * count + [2 * TARGET] + [1.0] * obstacles + [None],
            behaviors=["avoid_obstacles", "surface"],
            robot_radius=[ROBOT] * count,
            neighbors=[[i + 1, (i + 1) % count + 1] for i in range(count)] if count > 2 else [],
            spacing=2 * RADIUS * math.sin(math.pi / count),
            title=title,
            height=ROBOT if axes == 2 else 0.0,
            mission_radius=RADIUS,
            target_radius=TARGET,
            safe_distance=SAFE if obstacles else 0.0,
            safe_distance_measure="surface" if obstacles else "none",
        )
        rng = np.random.default_rng(3)
        distance = np.linalg.norm(q[:, :, None] - places, axis=-1)
        between = np.linalg.norm(q[:, :, None] - q[:, None], axis=-1) + np.diag([np.inf] * count)
        nearest = between.min(axis=2)
        clearance = np.full((samples, count, 4), np.inf)
        clearance[..., 0] = nearest - 2 * ROBOT
        clearance[..., 1] = np.linalg.norm(q - target[:, None], axis=-1) - ROBOT - TARGET
        clearance[..., 2] = distance.min(axis=2, initial=np.inf) - ROBOT - 0.5
        known = {
            "obstacle_position": np.tile(places, (samples, 1, 1)),
            "q": q,
            "target_position": target,
            "qpos": q.reshape(samples, count * axes),
            "e": 0.02 * rng.standard_normal(q.shape),
            "e_dot": 0.02 * rng.standard_normal(q.shape),
            "force": np.clip(6.0 * rng.standard_normal(q.shape), -10, 10),
            "obstacle_distance": distance,
            "robot_distance_min": nearest,
            "clearance": clearance,
            "avoidance_active": distance.min(axis=2, initial=np.inf) < SAFE + ROBOT + 0.5,
            "lost": np.zeros((samples, count)) if lost is None else lost,
            "mass_matrix": np.broadcast_to(np.diag([1.0, 2.0, 3.0][:axes]), (samples, count, axes, axes)),
            "reference_torque": 5.0 * rng.standard_normal(q.shape),
            "lyapunov": np.exp(-np.outer(time, 1.0 + np.arange(count))),
            "lyapunov_change": -np.linspace(0.0, 1.0, len(CAUSES))
            * time[:, None, None]
            * np.ones((1, count, 1)),
        }
        given = {
            signal.name: known[signal.name]
            for signal in SIGNALS
            if signal.recorded(sizes) and signal.name in known
        }
        record = pack(time, sizes, **given)
        folder = RunFolder.create(tmp_path_factory.mktemp("run"))
        scenario = f"name: {title}\nvideo: {video}\n"
        folder.begin(scenario, model_xml(q[0], target[0], places) if samples else "", sizes, labels)
        trace = build_trace(record, sizes, labels)
        message = "completed 6 s" if outcome.good else "robot 1 is 300 m from the target at 5.90 s"
        folder.finish(outcome, message, trace, {}, [make_verdict(passed=outcome.good)])
        return folder.path

    return make


@pytest.fixture(scope="session")
def drawn_run(make_run) -> Path:
    """A planar run whose figures were drawn, without a warning, of few pixels."""
    folder = make_run(title="a <b> & c")
    with pytest.MonkeyPatch.context() as patch, warnings.catch_warnings():
        patch.setattr(style, "DPI", 60)
        warnings.simplefilter("error")
        draw_figures(folder)
    return folder


@pytest.fixture(autouse=True, scope="session")
def coarse() -> Iterator[None]:
    """Draw figures of fewer pixels, which takes less time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(style, "DPI", 100)
        yield
