"""The command that draws pictures of a run: render."""

from __future__ import annotations

import re
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from escort_mj.cli.app import Answer, command, drawing_video, progress_bar, shown_path
from escort_mj.cli.options import LOOK, Either, Formats, RunFolder, Texts
from escort_mj.errors import UsageError

if TYPE_CHECKING:
    from escort_mj.scenario.schema.scenario import Video


@command(
    "render",
    like=LOOK,
    flags={
        "start": "--from",
        "end": "--to",
        "size": "--size WxH",
        "look_at": "--look-at X,Y,Z",
        "video_format": "--format",
        "only": "--only NAME",
    },
)
def render_command(
    run_folder: RunFolder,
    camera: Literal["overview", "follow", "top", "robot"] | None = None,
    robot: int | None = None,
    look_at: str | None = None,
    azimuth: float | None = None,
    elevation: float | None = None,
    distance: float | None = None,
    start: float | None = None,
    end: float | None = None,
    size: str | None = None,
    rate: int | None = None,
    speed: float | None = None,
    video_format: Literal["mp4", "webp"] | None = None,
    out: Path | None = None,
    video: Either = True,
    figures: Either = True,
    only: Texts = (),
    formats: Formats = (),
    **look: Any,
) -> Answer:
    """Redraw the figures and the video of a run folder.

    Without options, the video follows the scenario's table `video`.

    Example: escort-mj render renders/main --no-figures --camera follow --from 10 --to 20

    Example: escort-mj render renders/main --no-figures --format webp --size 640x360 --rate 12

    Example: escort-mj render renders/main --no-video --only paths --figure-format pdf --width column

    Args:
        camera: Camera of the video; None for the scenario's.
        robot: Robot that the camera `robot` goes behind.
        look_at: Point that the camera looks at the whole time [m], such as 0,3,1.
        azimuth: Direction of view around the vertical [deg].
        elevation: Direction of view above the horizon [deg]; -90 looks straight down.
        distance: Distance of the camera from the point it looks at [m].
        start: Simulated time at which the video begins [s].
        end: Simulated time at which the video ends [s].
        size: Width and height of the video [pixel], such as 640x360.
        rate: Frames per second.
        speed: Simulated seconds per second of the video.
        video_format: Format of the video; None for mp4.
        out: File of the video; its suffix selects the format; None for RUN/video.FORMAT.
        video: Whether to render the video.
        figures: Whether to draw the figures.
        only: Figure to draw, such as paths; repeatable [default: all].
        formats: Format of the figures; repeatable [default: png].
    """
    from escort_mj.record.folder import read_run

    changes: dict[str, Any] = {
        "camera": camera,
        "robot": robot,
        "azimuth": azimuth,
        "elevation": elevation,
        "distance": distance,
    }
    changes |= {"start": start, "end": end, "rate": rate, "speed": speed} | _sides(size) | _point(look_at)
    if only and not figures:
        raise UsageError("--only names figures to draw; --no-figures draws none")
    if not (video or figures):  # which would read it
        read_run(run_folder)
    wanted = _video(run_folder, {key: value for key, value in changes.items() if value is not None})
    file = _file(run_folder, out, video_format)
    written: list[str] = []
    with drawing_video(run_folder, wanted, file) if video else nullcontext(lambda: False) as rendered:
        if figures:
            from escort_mj.report.figures.drawing.look import look_of, looking
            from escort_mj.report.figures.figures import draw_figures

            with looking(look_of(**look)), progress_bar("drawing the figures", "", announced=True):
                drawn = draw_figures(run_folder, formats or ("png",), only)
            written += map(shown_path, drawn)
        if rendered():
            written.append(shown_path(file))
    return Answer(written, {"written": written})


def _sides(size: str | None) -> dict[str, int]:
    """Width and height of `WxH`."""
    if size is None:
        return {}
    if (found := re.fullmatch(r"(\d{1,9})[x×](\d{1,9})", size.strip())) is None:
        raise UsageError(f"--size: found {size}; expected WIDTHxHEIGHT in pixels, such as 640x360")
    return {"width": int(found[1]), "height": int(found[2])}


def _point(look_at: str | None) -> dict[str, list[float]]:
    """The point `X,Y,Z`."""
    if look_at is None:
        return {}
    try:
        x, y, z = map(float, look_at.split(","))
    except ValueError:
        raise UsageError(f"--look-at: found {look_at}; expected three numbers [m], such as 0,3,1") from None
    return {"look_at": [x, y, z]}


def _video(folder: Path, changes: dict[str, Any]) -> Video | None:
    """The scenario's video with other values; None where there are none."""
    if not changes:
        return None
    from escort_mj.record.folder import read_run
    from escort_mj.scenario.reader.load import stored_scenario

    run = read_run(folder)
    scenario = stored_scenario(run.scenario_yaml, run.scenario_file)
    return scenario.replace({f"video.{key}": value for key, value in changes.items()}).video


def _file(folder: Path, out: Path | None, chosen: str | None) -> Path:
    """The file of the video."""
    if out is None:
        return folder / f"video.{chosen or 'mp4'}"
    if chosen is not None and out.suffix != f".{chosen}":
        raise UsageError(f"--out: found {out}; --format {chosen} expects the suffix .{chosen}")
    return out
