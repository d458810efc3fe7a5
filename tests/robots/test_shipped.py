"""Every kind of robots that ships is held to what is asked of a plugin's."""

import pytest

from escort_mj.conformance.kinds import check_kind
from escort_mj.conformance.missions import check_missions
from escort_mj.conformance.parameters import check_parameters
from escort_mj.robots import KINDS, RobotKind
from escort_mj.robots.mjcf import FileKind
from escort_mj.scenario.reader.plugin_shape import check_shape
from escort_mj.scenario.schema.scenario import Scenario

GRAVITY = (0.0, 0.0, -9.81)

SHIPPED = [kind for kind in KINDS if not issubclass(kind, FileKind)]  # a file's robot is what the file says

pytestmark = pytest.mark.parametrize("kind", SHIPPED, ids=lambda kind: kind.model_fields["kind"].default)


@pytest.mark.parametrize("checks", [check_parameters, check_kind, check_missions])
def test_it_holds_what_check_plugin_asks(
    compiled: None, hurried: None, kind: type[RobotKind], checks
) -> None:
    check_shape(kind, "it")
    assert not [row for row in checks(kind, Scenario) if not row.held]


def test_its_answers_fit_one_another(kind: type[RobotKind]) -> None:
    robot, axes = kind(), min(kind.most_axes, 3)
    motors = robot.free_motors(1.5, 0.25, GRAVITY)
    gains = [motor for motor in motors if motor.limits is not None]
    assert len(motors or range(axes)) == robot.actuators(axes)
    assert len(gains or range(axes)) == robot.motors(axes)
    assert kind.flies == (robot.craft(1.5, 0.25, GRAVITY, 1.0) is not None) == any(robot.lift(1.5, GRAVITY))
    assert kind.needs_gravity or not (kind.rolls or kind.flies)
    assert not list(robot.misfits(0.2)), "the defaults fit the default radius"
