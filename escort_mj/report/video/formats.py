"""File formats of a video."""

from __future__ import annotations

from typing import Any, NamedTuple


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
