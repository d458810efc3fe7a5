"""Frames to a file, one by one: h264 as every browser plays it, or animated WebP."""

from __future__ import annotations

import resource
import shutil
import subprocess
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import RenderError, WriteError


class Encoding(NamedTuple):
    """How frames are encoded.

    Attributes:
        encoder: The encoder in ffmpeg that must be there.
        options: Of mediapy's writer.
    """

    encoder: str
    options: dict[str, Any]


def _options(codec: str, encoded_format: str, *arguments: str) -> dict[str, Any]:
    return {"codec": codec, "encoded_format": encoded_format, "ffmpeg_args": arguments}


ENCODINGS = {
    ".mp4": Encoding(
        "libx264",
        _options("h264", "yuv420p", "-preset", "veryfast", "-movflags", "+faststart") | {"crf": 23},
    ),
    ".webp": Encoding("libwebp_anim", _options("libwebp_anim", "yuv420p", "-q:v", "60", "-loop", "0")),
}
"""By suffix."""


FAULTS = (OSError, RuntimeError)  # a broken pipe to the encoder, or the encoder's own words
LEAST_SPACE = 4 << 20  # bytes; with less the disk counts as full
NO_FFMPEG = "there is no ffmpeg here; this brings one: pip install 'escort-mj[video]'"


def find_ffmpeg() -> str:
    """The program that encodes: imageio-ffmpeg's own (extra `video`), or the one on the path.

    Raises:
        RenderError: If there is neither.
    """
    try:
        import imageio_ffmpeg
    except ImportError:
        program = shutil.which("ffmpeg")
    else:
        program = imageio_ffmpeg.get_ffmpeg_exe()
    if program is None:
        raise RenderError(NO_FFMPEG)
    return program


def require_encoder(program: str, encoder: str) -> None:
    """Check that an ffmpeg has an encoder.

    Raises:
        RenderError: If it has not.
    """
    asked = [program, "-hide_banner", "-h", f"encoder={encoder}"]
    said = subprocess.run(asked, capture_output=True, text=True, errors="replace", check=False)
    if f"Encoder {encoder}" not in said.stdout:
        raise RenderError(
            f"{program} lacks the encoder {encoder}; this brings an ffmpeg that has it: "
            "pip install 'escort-mj[video]'"
        )


class VideoFile:
    """A video that frames are appended to, as a context.

    Attributes:
        path: The video; it goes if anything fails.
    """

    def __init__(self, path: Path, size: tuple[int, int], rate: int) -> None:
        """Prepare a video.

        Args:
            path: Where to write; the suffix, one of `ENCODINGS`, chooses the format.
            size: Width and height, both even [pixel].
            rate: Frames per second.

        Raises:
            RenderError: If there is no ffmpeg, or it lacks the encoder.
        """
        import mediapy  # slow to import

        ffmpeg = find_ffmpeg()
        mediapy.set_ffmpeg(ffmpeg)
        encoding = ENCODINGS[path.suffix]
        if path.suffix != ".mp4":  # which every ffmpeg encodes somehow
            require_encoder(ffmpeg, encoding.encoder)
        self.path = path
        self._writer = mediapy.VideoWriter(path, size[::-1], fps=rate, **encoding.options)

    def __enter__(self) -> VideoFile:
        try:
            self._writer.__enter__()
        except FAULTS as fault:
            raise self._error(fault) from fault
        return self

    def add(self, frame: NDArray[np.uint8]) -> None:
        """Appends one frame, shape (height, width, 3).

        Raises:
            RenderError: If it cannot be encoded.
            WriteError: If the disk is full.
        """
        try:
            self._writer.add_image(frame)
        except FAULTS as fault:
            raise self._error(fault) from fault

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self._writer.close()
        except FAULTS as failed:
            if fault is None:
                fault = failed
                raise self._error(failed) from failed
        finally:
            if fault is not None:
                self.path.unlink(missing_ok=True)

    def _error(self, fault: Exception) -> RenderError | WriteError:
        """Return the fault in a sentence; a broken pipe does not say why the encoder went."""
        folder = self.path.parent
        if folder.is_dir() and shutil.disk_usage(folder).free < LEAST_SPACE:
            return WriteError(self.path, "the disk is full")
        limit, _ = resource.getrlimit(resource.RLIMIT_FSIZE)
        if limit != resource.RLIM_INFINITY and self.path.is_file() and self.path.stat().st_size >= limit:
            return WriteError(self.path, f"a file may have at most {limit} bytes here (ulimit -f)")
        reason = (str(fault).strip() or type(fault).__name__).splitlines()[-1]
        return RenderError(f"{self.path} cannot be written: {reason}")
