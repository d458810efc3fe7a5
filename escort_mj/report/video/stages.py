"""What happens along axes beyond the third: a picture for each of the model's stages."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj.components.mission import axis_names
from escort_mj.report.video.replay import Replay
from escort_mj.world.stages import DIRECTIONS, IN_SPACE, SHADOW

Array = NDArray[np.float64]
Pixels = NDArray[np.uint8]

SHARE = 0.3  # of a picture's width for the stages beside the mission
GAP = 4  # pixels between pictures


@dataclass(frozen=True)
class Panel:
    """One picture among those that make up a frame.

    Attributes:
        number: Of its stage; 0 for the mission's own place. Only geoms of this group are seen.
        left: Column of its left edge [pixel].
        top: Row of its top edge [pixel].
        width: [pixel].
        height: [pixel].
    """

    number: int
    left: int
    top: int
    width: int
    height: int

    def cut(self, frame: Pixels) -> Pixels:
        """Its part of a frame of shape (height, width, 3), as a view."""
        return frame[self.top : self.top + self.height, self.left : self.left + self.width]


def panels_of(stages: int, width: int, height: int) -> list[Panel]:
    """How a frame is shared by the mission, on the left, and its stages, one below another on the right."""
    if not stages:
        return [Panel(0, 0, 0, width, height)]
    right = int(SHARE * width)
    own = Panel(0, 0, 0, width - right - GAP, height)
    each = (height - GAP * (stages - 1)) // stages
    return [own, *(Panel(s + 1, width - right, s * (each + GAP), right, each) for s in range(stages))]


def stage_replays(replay: Replay, model: mujoco.MjModel) -> Iterator[Replay]:
    """The same run as it is seen on each stage beside the mission's own place.

    Args:
        replay: The run.
        model: Its model.
    """
    names = [model.body(body).name for body in range(model.nbody)]
    axes = axis_names(replay.target_coordinates.shape[1])
    for number in itertools.count(1):
        suffix = f"{SHADOW}{number}"
        if f"target{suffix}" not in names:
            return
        robots = [_way(model, f"robot_{i + 1}{suffix}", replay.qpos) for i in range(replay.count)]
        others = [
            name for name in names if name.endswith(suffix) and not name.startswith(("robot_", "target"))
        ]
        own = slice(IN_SPACE * number, IN_SPACE * (number + 1))
        target = np.tile(model.body(f"target{suffix}").pos, (len(replay.time), 1))
        moved = (replay.target_coordinates - replay.target_coordinates[0])[:, own]
        target[:, ["xyz".index(direction) for direction in DIRECTIONS[moved.shape[1]]]] += moved
        yield replace(
            replay,
            robots=np.stack(robots, axis=1),
            target=target,
            obstacles=np.tile(
                np.array([model.body(name).pos for name in others]).reshape(-1, 3), (len(replay.time), 1, 1)
            ),
            axes=tuple(axes[own]),
            suffix=suffix,
            facing=moved.shape[1] < IN_SPACE,
        )


def _way(model: mujoco.MjModel, name: str, qpos: Array) -> Array:
    """Positions of a body that slides, shape (T, 3) [m]."""
    body = model.body(name)
    joints = slice(body.jntadr[0], body.jntadr[0] + body.jntnum[0])
    places = model.jnt_qposadr[joints]
    moved: Array = body.pos + (qpos[:, places] - model.qpos0[places]) @ model.jnt_axis[joints]
    return moved
