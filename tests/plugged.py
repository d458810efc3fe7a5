"""Plugins that tests share, as text, and how to check them in little time."""

from pathlib import Path

import pytest

from escort_mj.conformance import behaviors, estimators, missions, repeats
from tests.corpus import documents

WRONG = Path(__file__).parent / "components" / "wrong"


def plugin(kind: str, *files: str) -> tuple[str, str]:
    """Return a plugin that is right, and a scenario that takes it from files of some names."""
    head = documents(WRONG / f"{kind}.yaml")[0]
    return head["plugin"], head["scenario"].replace("own.py", ", ".join(files) or "own.py")


def hurry(patch: pytest.MonkeyPatch) -> None:
    """Let checks of plugins draw a few times and fly shortly; slow tests check all that ships in full."""
    for module in (behaviors, estimators, repeats):
        patch.setattr(module, "DRAWS", 6)
    patch.setattr(missions, "DURATION", 0.3)
    patch.setattr(missions, "TIMES", 2)


LAW, SCENARIO = plugin("law", "own_law.py")
ESTIMATOR, _ = plugin("estimator")


COMPILED = """
    compiled: ClassVar[bool] = True
"""


BEHAVIOR = '''
"""Keeps robots at a height."""

from typing import Literal

from pydantic import PositiveFloat

from escort_mj.plugins import Behavior, Robots, Task, across, keep, unit_axis


class Layer(Behavior):
    """Keeps each robot at a height above the target, along the last axis."""

    behavior: Literal["layer"] = "layer"
    gain: PositiveFloat = 0.8
    """Gain of the error [1/s]."""
    height: float = 2.0
    """Height above the target's center [m]."""

    def task(self, r: Robots) -> Task:
        """Keep the height."""
        height = r.q[-1] - r.target[-1]
        return keep(height, self.height, unit_axis(r.q, -1), self.gain)
'''


METRIC = '''
import numpy as np

from escort_mj.plugins import metric


@metric(unit="m", grows=True)
def farthest(trace):
    """Largest distance of a robot to the target."""
    far = np.linalg.norm(trace["q"].values - trace["target_position"].values[:, None], axis=2)
    return float(far.max())
'''

EXPECTATION = '''
import numpy as np
from pydantic import PositiveFloat

from escort_mj.plugins import Expectation, Judgment


class Near(Expectation):
    """No robot is ever farther from the target than so much."""

    kind = "near"

    near: PositiveFloat
    """Largest distance to the target [m]."""

    def judge(self, trace):
        far = np.linalg.norm(trace["q"].values - trace["target_position"].values[:, None], axis=2).max()
        return Judgment(held=bool(far <= self.near), words=f"{far:.3g} m", margin=self.near - far)
'''

KIND = '''
from typing import ClassVar, Literal

from pydantic import PositiveFloat

from escort_mj.plugins import RobotKind


class Crowned(RobotKind):
    """A sliding mass with a load on its head."""

    mjcf: ClassVar[str] = """
    <mujoco>
      <worldbody>
        <body name="robot">
          <joint name="x" type="slide" axis="1 0 0"/>
          <joint name="y" type="slide" axis="0 1 0"/>
          <joint name="z" type="slide" axis="0 0 1"/>
          <geom name="body" type="sphere" size="0.2"/>
          <body name="load">
            <geom name="ball" type="sphere" size="0.05" pos="0 0 0.1" contype="0" conaffinity="0"/>
          </body>
        </body>
      </worldbody>
      <actuator>
        <motor name="x" joint="x"/>
        <motor name="y" joint="y"/>
        <motor name="z" joint="z"/>
      </actuator>
    </mujoco>
    """

    kind: Literal["crowned"] = "crowned"
    load: PositiveFloat = 0.3
    """Mass of the load [kg]."""

    def burden(self):
        return self.load

    def shape(self, parts, radius):
        parts["load_ball"].set("mass", str(self.load))
'''
