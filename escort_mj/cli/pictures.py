"""The command that draws pictures of a run: render."""

from __future__ import annotations

import re
from contextlib import nullcontext
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from escort_mj.cli.app import (
    FiguresOption,
    JsonOption,
    RunArgument,
    VideoOption,
    app,
    drawing_video,
    finish,
    progress_bar,
    shown_path,
)
from escort_mj.errors import UsageError

if TYPE_CHECKING:
    from escort_mj.scenario.schema.scenario import Video


class CameraChoice(StrEnum):
    """Cameras of `--camera`."""

    OVERVIEW = "overview"
    FOLLOW = "follow"
    TOP = "top"


class VideoFormat(StrEnum):
    """Formats of `--format`."""

    MP4 = "mp4"
    WEBP = "webp"


class FigureFormat(StrEnum):
    """Formats of `--figure-format`."""

    PNG = "png"
    PDF = "pdf"
    SVG = "svg"


@app.command("render")
def render_command(
    run_folder: RunArgument,
    camera: Annotated[
        CameraChoice | None, typer.Option(help="Camera of the video [default: the scenario's].")
    ] = None,
    azimuth: Annotated[
        float | None, typer.Option(help="Direction of view around the vertical [deg].")
    ] = None,
    elevation: Annotated[
        float | None, typer.Option(help="Direction of view above the horizon [deg]; -90 looks straight down.")
    ] = None,
    distance: Annotated[
        float | None, typer.Option(help="Distance of the camera from the point it looks at [m].")
    ] = None,
    start: Annotated[
        float | None, typer.Option("--from", help="Simulated time at which the video begins [s].")
    ] = None,
    end: Annotated[
        float | None, typer.Option("--to", help="Simulated time at which the video ends [s].")
    ] = None,
    size: Annotated[
        str | None,
        typer.Option(metavar="WxH", help="Width and height of the video [pixel], such as 640x360."),
    ] = None,
    rate: Annotated[int | None, typer.Option(help="Frames per second.")] = None,
    speed: Annotated[float | None, typer.Option(help="Simulated seconds per second of the video.")] = None,
    video_format: Annotated[
        VideoFormat | None, typer.Option("--format", help="Format of the video [default: mp4].")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="File of the video; its suffix selects the format [default: RUN/video.FORMAT]."),
    ] = None,
    video: VideoOption = True,
    figures: FiguresOption = True,
    formats: Annotated[
        list[FigureFormat] | None,
        typer.Option("--figure-format", help="Format of the figures; repeatable [default: png]."),
    ] = None,
    width: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH",
            help="Width of the figures: column (3.5in), page (7.2in) or a length such as 8.8cm "
            "[default: page].",
        ),
    ] = None,
    font: Annotated[str | None, typer.Option(metavar="FAMILY", help="Font of the figures.")] = None,
    font_size: Annotated[float | None, typer.Option(help="Font size of the figures [pt].")] = None,
    title: Annotated[bool, typer.Option("--title/--no-title", help="Whether figures have a title.")] = True,
    as_json: JsonOption = False,
) -> None:
    """Redraw the figures and the video of a run folder.

    Without options, the video follows the scenario's table `video`.

    Example: escort-mj render renders/main --no-figures --camera follow --from 10 --to 20

    Example: escort-mj render renders/main --no-figures --format webp --size 640x360 --rate 12

    Example: escort-mj render renders/main --no-video --figure-format pdf --width column --font-size 7
    """
    changes: dict[str, Any] = {"camera": camera and camera.value, "azimuth": azimuth, "elevation": elevation}
    changes |= {"distance": distance, "start": start, "end": end, "rate": rate, "speed": speed} | _sides(size)
    wanted = _video(run_folder, {key: value for key, value in changes.items() if value is not None})
    file = _file(run_folder, out, video_format)
    written: list[str] = []
    with drawing_video(run_folder, wanted, file) if video else nullcontext(lambda: False) as rendered:
        if figures:
            from escort_mj.report.figures.drawing.look import look_of
            from escort_mj.report.figures.figures import draw_figures

            look = look_of(width, font, font_size, title)
            with progress_bar("drawing the figures", "", announced=True):
                drawn = draw_figures(run_folder, [one.value for one in formats or (FigureFormat.PNG,)], look)
            written += map(shown_path, drawn)
        if rendered():
            written.append(shown_path(file))
    finish("render", as_json, written, written=written)


def _sides(size: str | None) -> dict[str, int]:
    """Width and height of `WxH`."""
    if size is None:
        return {}
    if (found := re.fullmatch(r"(\d{1,9})[x×](\d{1,9})", size.strip())) is None:
        raise UsageError(f"--size: found {size}; expected WIDTHxHEIGHT in pixels, such as 640x360")
    return {"width": int(found[1]), "height": int(found[2])}


def _video(folder: Path, changes: dict[str, Any]) -> Video | None:
    """The scenario's video with other values; None where there are none."""
    if not changes:
        return None
    from escort_mj.record.folder import read_run
    from escort_mj.scenario.reader.load import stored_scenario

    run = read_run(folder)
    scenario = stored_scenario(run.scenario_yaml, run.path)
    return scenario.replace({f"video.{key}": value for key, value in changes.items()}).video


def _file(folder: Path, out: Path | None, chosen: VideoFormat | None) -> Path:
    """The file of the video."""
    if out is None:
        return folder / f"video.{(chosen or VideoFormat.MP4).value}"
    if chosen is not None and out.suffix != f".{chosen.value}":
        raise UsageError(f"--out: found {out}; --format {chosen.value} expects the suffix .{chosen.value}")
    return out
