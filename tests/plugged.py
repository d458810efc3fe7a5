"""Plugins that tests share, as text, and how to check them in little time."""

import pytest

from escort_mj.conformance import behaviors, estimators, missions, repeats


def hurry(patch: pytest.MonkeyPatch) -> None:
    """Let checks of plugins draw a few times and fly shortly; slow tests check all that ships in full."""
    for module in (behaviors, estimators, repeats):
        patch.setattr(module, "DRAWS", 6)
    patch.setattr(missions, "DURATION", 0.3)
    patch.setattr(missions, "TIMES", 2)


LAW = '''
"""PD with an estimate."""

from typing import ClassVar, Literal

from pydantic import NonNegativeFloat

from escort_mj.plugins import Law, Values


class Pid(Law):
    """PD with an estimate that follows s."""

    law: Literal["pid"] = "pid"
    proportional_gain: NonNegativeFloat = 30.0
    """Gain of the position error [N/m]."""
    derivative_gain: NonNegativeFloat = 50.0
    """Gain of the velocity error [N s/m]."""
    integral_gain: NonNegativeFloat = 20.0
    """Rate at which the estimate follows s [N/m]."""
    fails_at: float = 1e9
    """When it breaks [s]."""

    def force(self, r: Values):
        """PD with the estimate."""
        if r.time >= self.fails_at:
            raise ZeroDivisionError("told to")
        return r.rho_hat + self.proportional_gain * r.e + self.derivative_gain * r.e_dot

    def rho_hat_rate(self, r: Values):
        """The rate of the estimate."""
        return self.integral_gain * r.s
'''

COMPILED = """
    compiled: ClassVar[bool] = True
"""

SCENARIO = """
name: own
duration: 2
target: {position: ["0.3*t", 0]}
plugins: [own_law.py]
controller: {law: pid}
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

ESTIMATOR = '''
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from escort_mj.plugins import Belief, Estimator, Witness


class AlphaBeta(Estimator):
    """Correct position and velocity by fixed shares of the error (alpha-beta filter)."""

    needs: ClassVar[tuple[tuple[str, ...], ...]] = (("position",),)
    has_covariance: ClassVar[bool] = False

    estimator: Literal["alpha_beta"] = "alpha_beta"
    alpha: Annotated[float, Field(gt=0.0, le=1.0)] = 0.1
    """Share of the error by which a look corrects the position [1]."""
    beta: Annotated[float, Field(gt=0.0, le=1.0)] = 0.005
    """Share of the error, per time between two looks, by which it corrects the velocity [1]."""

    def sees(self, r: Witness) -> Belief:
        """Return the belief, moved on and corrected by what is seen."""
        elapsed = r.time - r.belief.time
        ahead = r.belief.position + elapsed * r.belief.velocity
        error = r.seen_position - ahead
        faster = self.beta / elapsed * error if elapsed > 0.0 else 0.0 * error
        return r.believe(ahead + self.alpha * error, r.belief.velocity + faster)
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
