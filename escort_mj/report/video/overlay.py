"""Words over the video's frames: name, time, who is who, and how the run ended."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from escort_mj import palette
from escort_mj.palette import LOST
from escort_mj.report.figures.drawing.fonts import font_file, legible
from escort_mj.report.video.replay import Flags

Pixels = NDArray[np.uint8]
Ink = tuple[int, int, int]

DARK: Ink = (30, 33, 38)
SOFT: Ink = (85, 90, 98)
PAPER: Ink = (255, 255, 255)
GOOD: Ink = (0, 104, 77)
BAD: Ink = (176, 0, 32)


@cache
def _font(size: int, bold: bool = False) -> ImageFont.FreeTypeFont:
    """The pictures' own font."""
    return ImageFont.truetype(font_file(bold), size)


class Overlay:
    """Writes on frames of one size.

    Attributes:
        title: Name of the scenario.
        speed: Simulated seconds per second of the video.
        count: Number of robots.
    """

    def __init__(self, title: str, speed: float, count: int, size: tuple[int, int]) -> None:
        self.title = legible(title)
        self.speed = speed
        self.count = count
        self._size = size
        self._unit = max(size[1] / 720.0, 0.45)
        self.paint(palette.robot_colors(count))

    def paint(self, colors: Sequence[palette.Color]) -> None:
        """Take other colors for robots from now on."""
        self._inks = [_ink(color) for color in colors]

    def write(
        self,
        frame: Pixels,
        time: float,
        avoiding: Flags,
        touching: Flags,
        lost: Flags,
        ending: tuple[str, bool] | None = None,
    ) -> None:
        """Writes on a frame, in place.

        Args:
            frame: Shape (height, width, 3).
            time: Simulated time [s].
            avoiding: Robots to name as avoiding something, shape (n,).
            touching: Robots to name as touching something, shape (n,).
            lost: Robots that the team has lost, shape (n,).
            ending: How the run ended, in words, and whether that is well; None before the end.
        """
        image = Image.fromarray(frame)
        draw = ImageDraw.Draw(image, "RGBA")
        left = self._px(28)
        self._text(draw, (left, self._px(22)), self._fitted(self.title, 24), DARK, _font(self._px(24), True))
        clock = f"t = {time:.{1 if self.speed >= 1 else 2}f} s"
        self._text(draw, (left, self._px(56)), clock, DARK, _font(self._px(18)))
        pace = f"{self.speed:.3g}× real time" if self.speed != 1 else "real time"
        self._text(draw, (left + self._px(150), self._px(56)), pace, SOFT, _font(self._px(18)))
        self._legend(draw, avoiding, touching, lost)
        if ending is not None:
            self._banner(draw, *ending)
        np.copyto(frame, np.asarray(image))

    def _px(self, pixels: float) -> int:
        """A length of a picture 720 high, in this picture."""
        return max(1, round(pixels * self._unit))

    def _fitted(self, words: str, size: float, bold: bool = True) -> str:
        """Words shortened to the picture's width."""
        font, room = _font(self._px(size), bold), self._size[0] - self._px(80)
        if font.getlength(words) <= room:
            return words
        while words and font.getlength(words + "…") > room:
            words = words[:-1]
        return words + "…"

    def _text(
        self,
        draw: ImageDraw.ImageDraw,
        at: tuple[float, float],
        words: str,
        ink: Ink,
        font: ImageFont.FreeTypeFont,
    ) -> None:
        """Words with a pale rim, readable on anything."""
        draw.text(at, words, fill=ink, font=font, stroke_width=self._px(2), stroke_fill=(*PAPER, 170))

    def _legend(self, draw: ImageDraw.ImageDraw, avoiding: Flags, touching: Flags, lost: Flags) -> None:
        """Who is who, and who does what: a numbered dot per robot, or a ramp where there are too many."""
        left, middle = self._px(28), self._size[1] - self._px(36)
        if self.count > palette.MOST_DISTINCT:
            right = self._ramp(draw, left, middle)
        else:
            right = self._dots(draw, left, middle, avoiding, touching, lost)
        at = (right + self._px(12), middle - self._px(10))
        if touching.any():
            self._text(draw, at, f"{_named(touching)} in contact", BAD, _font(self._px(16), True))
        elif avoiding.any():
            self._text(draw, at, f"{_named(avoiding)} avoiding", SOFT, _font(self._px(16)))
        elif lost.any():
            self._text(draw, at, f"{_named(lost)} lost", SOFT, _font(self._px(16)))

    def _ramp(self, draw: ImageDraw.ImageDraw, left: int, middle: int) -> int:
        """Draw the colors of a large team, and return where they end."""
        width, half = self._px(220), self._px(8)
        for column in range(width):
            ink = self._inks[column * self.count // width]
            draw.line([(left + column, middle - half), (left + column, middle + half)], ink)
        font = _font(self._px(15))
        words = f"robots 1 to {self.count}"
        self._text(draw, (left + width + self._px(12), middle - self._px(9)), words, SOFT, font)
        return left + width + self._px(12) + round(font.getlength(words))

    def _dots(
        self,
        draw: ImageDraw.ImageDraw,
        left: int,
        middle: int,
        avoiding: Flags,
        touching: Flags,
        lost: Flags,
    ) -> int:
        """Draw a numbered dot per robot, and return where they end."""
        radius, step = self._px(12), self._px(34)
        for index, ink in enumerate(self._inks):
            at = (left + radius + index * step, middle)
            if touching[index] or avoiding[index]:
                self._dot(draw, at, radius + self._px(4), BAD if touching[index] else (*ink, 110))
            if lost[index]:
                ink = _ink(LOST)
            self._dot(draw, at, radius, ink)
            draw.text(at, str(index + 1), fill=_readable_on(ink), font=_font(self._px(14), True), anchor="mm")
            if lost[index]:
                x, y, arm = *at, radius - self._px(2)
                draw.line([x - arm, y - arm, x + arm, y + arm], BAD, self._px(3))
                draw.line([x - arm, y + arm, x + arm, y - arm], BAD, self._px(3))
        return left + self.count * step

    @staticmethod
    def _dot(draw: ImageDraw.ImageDraw, at: tuple[int, int], radius: int, ink: tuple[int, ...]) -> None:
        draw.ellipse([at[0] - radius, at[1] - radius, at[0] + radius, at[1] + radius], fill=ink)

    def _banner(self, draw: ImageDraw.ImageDraw, words: str, well: bool) -> None:
        """How the run ended, large."""
        font = _font(self._px(22), True)
        words = self._fitted(words, 22)
        center = (self._size[0] / 2, self._size[1] - self._px(90))
        left, top, right, bottom = draw.textbbox(center, words, font=font, anchor="mm")
        pad = self._px(14)
        box = [left - 1.6 * pad, top - pad, right + 1.6 * pad, bottom + pad]
        draw.rounded_rectangle(box, radius=pad, fill=(*(GOOD if well else BAD), 225))
        draw.text(center, words, fill=PAPER, font=font, anchor="mm")


def _ink(color: palette.Color) -> Ink:
    red, green, blue = (round(255 * channel) for channel in color)
    return red, green, blue


def _readable_on(ink: Ink) -> Ink:
    """Dark or light letters, whichever stand out more."""
    return DARK if 0.299 * ink[0] + 0.587 * ink[1] + 0.114 * ink[2] > 140 else PAPER


def _named(flags: Flags) -> str:
    """The robots with a raised flag, by number; how many where they are too many to name."""
    numbers = [str(index + 1) for index in np.flatnonzero(flags)]
    if len(numbers) > 6:
        return f"{len(numbers)} robots"
    return f"robot{'s' * (len(numbers) > 1)} {', '.join(numbers)}"
