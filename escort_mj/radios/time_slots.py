"""A radio with time slots (TDMA)."""

from typing import Any, ClassVar, Literal

from pydantic import PositiveFloat

from escort_mj.native.values import Values
from escort_mj.radios.radio import Radio


class TimeSlots(Radio):
    """Each robot sends only in its own slot of a frame, in the order of the robots' numbers (TDMA)."""

    times: ClassVar[tuple[str, ...]] = ("slot",)
    radio: Literal["time_slots"] = "time_slots"
    slot: PositiveFloat = 0.02
    """Length of a slot [s], a whole number of physics steps; a frame has one for each robot."""

    def sends(self, r: Values) -> Any:
        """Return the start of the sender's slot in the frame of the message's number."""
        return (r.number * r.robots + r.sender) * self.slot

    def period(self, timestep: float, robots: int) -> float:
        """Return the length of a frame [s]."""
        return self.slot * robots
