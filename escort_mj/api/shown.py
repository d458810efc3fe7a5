"""Files that notebooks show: a video, a page."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class ShownFile:
    """A file that was written; it does wherever a path does.

    Attributes:
        path: The file.
    """

    path: Path

    def __fspath__(self) -> str:
        return str(self.path)

    def __str__(self) -> str:
        return str(self.path)


class ShownVideo(ShownFile):
    """A video, or an animated picture, which notebooks play."""

    def _repr_html_(self) -> str:
        data = base64.b64encode(self.path.read_bytes()).decode()
        if self.path.suffix != ".mp4":
            return f'<img style="max-width:100%" src="data:image/{self.path.suffix[1:]};base64,{data}">'
        return f'<video controls style="max-width:100%" src="data:video/mp4;base64,{data}"></video>'


class ShownPage(ShownFile):
    """A page, to which notebooks link."""

    def _repr_html_(self) -> str:
        from html import escape  # its table of names takes 2 ms

        name = escape(str(self.path))
        return f'<a href="{escape(self.path.resolve().as_uri())}">{name}</a>'
