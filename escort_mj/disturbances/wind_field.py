"""Wind or current from a file: velocities at the points of a grid."""

from collections.abc import Iterator
from typing import Any, ClassVar, Literal

from pydantic import Field

from escort_mj.components.component import OfMission
from escort_mj.components.facts import Facts, Misfit
from escort_mj.components.grid import Grid, grids_of, interpolate
from escort_mj.disturbances.disturbance import Robots
from escort_mj.disturbances.wind import Wind, drag
from escort_mj.native.vectors import Vec, where


def _or_file(schema: dict[str, Any]) -> None:
    """Let editors accept the name of a file, which the reader replaces by its grid."""
    schema["anyOf"].append({"type": "string", "pattern": r"\.npz$"})


class WindField(Wind):
    """Drag in a wind that depends on place and time, from a file.

    Between the points of the grid, velocities are interpolated linearly along each axis, and in time.
    """

    python_only: ClassVar[frozenset[str]] = Wind.python_only | {"grid"}
    disturbance: Literal["wind_field"] = "wind_field"
    grid: Grid | None = Field(None, json_schema_extra=_or_file)
    """Name of a .npz file in the scenario's folder. It has the coordinates of the points along each axis (the
    arrays x, y and so on [m]), their velocities (velocity [m/s], with an axis of the array for each of these,
    and a last one for the components) and, if these change, their times (time [s], the first axis)."""
    outside: Literal["calm", "nearest"] = "calm"
    """Wind outside the grid: none, or that of the nearest point of its boundary."""
    place = OfMission(lambda own, setup: own.found(setup)[0])
    row = OfMission(lambda own, setup: own.found(setup)[1])

    def misfits(self, mission: Facts) -> Iterator[Misfit]:
        """Yield a grid of other axes, or none."""
        if self.grid is None:
            yield Misfit("found none; give the name of a .npz file with one", "grid")
        elif len(self.grid.points) != mission.axes:
            yield Misfit(f"found {len(self.grid.points)} axes; expected {mission.axes}, as axes says", "grid")

    def found(self, setup: Any) -> tuple[int, int]:
        """Return where the grid lies among those of a mission; -1 for none."""
        places: dict[Any, tuple[int, int]] = (
            grids_of(setup.disturbances, setup.axes)[2] if setup is not None else {}
        )
        return places.get(self.grid, (-1, 0))

    def force(self, r: Robots) -> Vec:
        """Return the drag."""
        wind = 0.0 * r.q
        if self.place >= 0.0:
            wind, within = interpolate(int(self.place), int(self.row), r.i, r.seen)
            wind = where(within, wind, 0.0) if self.outside == 0 else wind
        return drag(self, r, wind)
