"""Scenarios broken at random: in their bytes, in their structure, and in their overrides."""

from __future__ import annotations

import copy
import json
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

PARTS = YAML(typ="safe").load(Path(__file__).with_suffix(".yaml"))
TOKENS: list[str] = PARTS["tokens"]
VALUES: list[Any] = [*PARTS["values"], "(" * 150, "x" * 300, [1] * 2000, [[0.0, 0.0]] * 300]


def broken(text: str, dice: random.Random) -> str:
    """A scenario's text with something wrong, or something odd, in it."""
    return dice.choice(WAYS)(text, dice)


def _bytes(text: str, dice: random.Random) -> str:
    """Characters that are cut, doubled, swapped or put in."""
    for _ in range(dice.choice((1, 1, 2, 5, 20))):
        at = dice.randrange(len(text) + 1)
        length = dice.choice((1, 2, 10, 100))
        cut = text[at : at + length]
        text = text[:at] + dice.choice(("", cut * 2, dice.choice(TOKENS), cut[::-1])) + text[at + length :]
    return text


def _lines(text: str, dice: random.Random) -> str:
    """Lines that are lost, doubled, shuffled or indented."""
    lines = text.splitlines(keepends=True)
    for _ in range(dice.choice((1, 1, 3))):
        at = dice.randrange(len(lines))
        line = lines[at]
        ways = ([], [line] * 2, ["  " + line], [line.lstrip()], [dice.choice(lines)], [line] * 500)
        lines[at : at + 1] = dice.choice(ways)
        if not lines:
            break
    return "".join(lines)


def _structure(text: str, dice: random.Random) -> str:
    """Values that are replaced by what does not belong there, keys that are renamed, dropped or moved."""
    data = YAML(typ="safe", pure=True).load(text)
    for _ in range(dice.choice((1, 1, 2, 4))):
        places = list(_places(data))
        holder, key = dice.choice(places)
        way = dice.randrange(4)
        if way == 0 and isinstance(holder, dict):
            holder[dice.choice(("position", "robot", "", "0", "a.b", str(key) + "s", "\u00e9"))] = holder.pop(
                key
            )
        elif way == 1:
            del holder[key]
        elif way == 2:
            other, place = dice.choice(places)
            if isinstance(other, dict | list) and (
                place in other if isinstance(other, dict) else place < len(other)
            ):
                holder[key] = copy.deepcopy(other[place])
        else:
            holder[key] = copy.deepcopy(dice.choice(VALUES))
        if not data:
            break
    return json.dumps(data, indent=1, ensure_ascii=dice.random() < 0.5)


def _places(node: Any) -> Any:
    """Every value of a structure, as what holds it and its key there."""
    for key, value in list(node.items() if isinstance(node, dict) else enumerate(node)):
        yield node, key
        if isinstance(value, dict | list):
            yield from _places(value)


def _bomb(text: str, dice: random.Random) -> str:
    """Small texts that want to be large: aliases of aliases, depth, numbers of thousands of digits."""
    depth = dice.choice((10, 30, 2000))
    aliases = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    aliases += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, 12)]
    return dice.choice(
        (
            "\n".join(aliases) + "\n" + text,
            text + f"\nwalls: {'[' * depth}{']' * depth}\n",
            text + f"\nseed: {'9' * 10 ** dice.choice((2, 4, 6))}\n",
            text + "\n" + "".join(f"{'  ' * k}k:\n" for k in range(depth)),
            text * 3,
            "&a [*a]\n",
            text.replace("t", "t" * 50),
            "",
        )
    )


WAYS: tuple[Callable[[str, random.Random], str], ...] = (
    *(_bytes, _bytes, _lines),
    *(_structure, _structure, _structure),
    _bomb,
)
