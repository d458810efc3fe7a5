"""Robot files broken at random, with what anybody may get wrong in MJCF or URDF."""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from escort_mj.api import scenarios_folder

PARTS: dict[str, Any] = YAML(typ="safe").load(Path(__file__).with_suffix(".yaml"))
GOOD: dict[str, str] = PARTS["good"] | {
    "hexarotor": (scenarios_folder() / "robots/hexarotor.xml").read_text()
}
"""Files that are right, but for the URDF, which has no actuators."""
EXTRAS = [*PARTS["extras"], "<worldbody><body>" * 300 + "</body></worldbody>" * 300]


def _value(text: str, dice: random.Random) -> str:
    """An attribute with a value of another kind, or out of range."""
    found = list(re.finditer(r'(\w+)="([^"]*)"', text))
    one = dice.choice(found)
    words = one[1] in ("name", "type", "joint", "site", "class", "mesh", "file", "link", "angle")
    value = dice.choice(PARTS["words" if words and dice.random() < 0.7 else "numbers"])
    if re.fullmatch(r"[-\d. e]+", one[2]) and dice.random() < 0.5:
        value = " ".join(f"{float(x) * dice.choice((-1, 0, 1e-9, 1e3, 1e12)):g}" for x in one[2].split())
    return text[: one.start(2)] + value + text[one.end(2) :]


def _lost(text: str, dice: random.Random) -> str:
    """An attribute or an element that is lost, doubled or moved to the end of another."""
    pattern = dice.choice((r'\s\w+="[^"]*"', r"<[^/!?][^>]*/>", r"</?\w+[^>]*>"))
    one = dice.choice(list(re.finditer(pattern, text)))
    return text[: one.start()] + one.group() * dice.choice((0, 0, 2)) + text[one.end() :]


def _renamed(text: str, dice: random.Random) -> str:
    """An element or an attribute with a name of another one, or of none."""
    one = dice.choice(list(re.finditer(r"(?<=<)\w+|(?<= )\w+(?==)", text)))
    name = dice.choice((one[0][:-1], one[0].upper(), dice.choice(PARTS["elements"])))
    return text[: one.start()] + name + text[one.end() :]


def _more(text: str, dice: random.Random) -> str:
    """An element that does not belong there, is circular, missing or huge."""
    ends = list(re.finditer(r"</(mujoco|robot|worldbody|body)>", text))
    at = dice.choice((ends[-1], dice.choice(ends))).start()
    return text[:at] + dice.choice(EXTRAS) + text[at:]


def _given(text: str, dice: random.Random) -> str:
    """An attribute that geoms, joints, bodies or motors have, with an odd value."""
    tag = dice.choice(("geom", "joint", "body", "motor"))
    found = list(re.finditer(rf"<{tag}(?=[ />])", text))
    if not found:
        return _value(text, dice)
    at = dice.choice(found).end()
    return f'{text[:at]} {dice.choice(PARTS["attributes"][tag])}="{dice.choice(PARTS["numbers"])}"{text[at:]}'


def _text(text: str, dice: random.Random) -> str:
    """Text that is no XML, or another one than it says."""
    return dice.choice(
        (
            lambda: text[: dice.randrange(len(text))],
            lambda: "",
            lambda: text + text,
            lambda: text.replace('"', "'", 1),
            lambda: "<!DOCTYPE a [<!ENTITY b 'c'>]>" + text,
            lambda: '<?xml version="1.0" encoding="utf-16"?>' + text,
            lambda: "\ufeff" + text,
            lambda: text.replace("base", "b\u202ease\0"),
            lambda: text.replace("mujoco", "robot"),
            lambda: text.replace("worldbody", "world"),
            lambda: "solid cube\nendsolid\n",
            lambda: '{"robot": 1}',
        )
    )()


WAYS: tuple[Callable[[str, random.Random], str], ...] = (
    *(_value, _value, _value, _lost, _renamed, _more),
    *(_given, _given, _text),
)


def robot_file(dice: random.Random) -> tuple[str, str]:
    """Return which file it was, and that with one or two things wrong in it."""
    name = dice.choice(sorted(GOOD))
    text = GOOD[name]
    for _ in range(dice.choice((1, 1, 2))):
        with suppress(IndexError):  # nothing is left of the kind
            text = dice.choice(WAYS)(text, dice)
    return name, text


def mission_of(name: str, folder: Path, text: str) -> dict[str, object]:
    """Write a robot file, and return a mission of two such robots."""
    (folder / "r.xml").write_text(text, errors="surrogatepass")
    still = [0.0] if name == "hexarotor" else []
    return {
        "duration": 0.1,
        "axes": 2 + len(still),
        "target": {"position": [9, 0, *still]},
        "robots": {"count": 2, "kind": {"kind": "mjcf", "file": "r.xml"}},
        "obstacles": [{"position": [4, 4, *(4.0 for _ in still)], "radius": 0.3}],
        "controller": {"gains": "auto"},
        "expect": [{"contacts": "none"}, {"sanity": "all"}],
    }
