"""The failures that ship: motors that are dead, stuck or mad."""

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, PositiveFloat

from escort_mj.components.facts import Facts, Misfit
from escort_mj.components.setup import MissionSetup
from escort_mj.failures.failure import Failure
from escort_mj.native.values import Values


class Dead(Failure):
    """Motors that give no force."""

    motors: ClassVar[Literal["obey", "off", "hold"]] = "off"
    kind: Literal["dead"] = "dead"

    def command(self, r: Values) -> Any:
        """Return no force."""
        return 0.0


class Stuck(Failure):
    """Motors that hold their last force."""

    motors: ClassVar[Literal["obey", "off", "hold"]] = "hold"
    kind: Literal["stuck"] = "stuck"

    def command(self, r: Values) -> Any:
        """Return the force of the step before."""
        return r.force_before


class Mad(Failure):
    """Motors that give random forces, each held for 0.5 s."""

    renews: ClassVar[float] = 0.5
    kind: Literal["mad"] = "mad"
    force: Annotated[PositiveFloat, Field(le=1e12)] | None = None
    """Largest force per axis [N]; null: the robot's force limit."""

    def command(self, r: Values) -> Any:
        """Return forces that are uniform between the bounds."""
        return self.force * r.draw

    def misfits(self, mission: Facts) -> Iterator[Misfit]:
        """Yield that it has no bound, where neither it nor its robot has."""
        if self.force is None and None in mission.force_limits[self.robot - 1 : self.robot]:
            yield Misfit(f"robot {self.robot} has no force_limit; give the force of its madness")

    def packed(self, setup: MissionSetup | None = None) -> dict[str, Any]:
        """Return its parameters as numbers, with the force limit of its robot where it has none."""
        found = super().packed(setup)
        if self.force is None and setup is not None:
            found["force"] = setup.force_limit[self.robot - 1]
        return found
