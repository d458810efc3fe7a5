"""Scenarios broken at random: in their bytes, in their structure, and in their overrides."""

from __future__ import annotations

import copy
import json
import random
from collections.abc import Callable
from typing import Any

from ruamel.yaml import YAML

TOKENS = [
    "\t",
    "\n",
    "  ",
    ":",
    "- ",
    "{",
    "}",
    "[",
    "]",
    "&a ",
    "*a",
    "<<: *a",
    "!!python/object:os.system ",
    "!!binary ",
    "|\n",
    ">\n",
    "#",
    "'",
    '"',
    "%YAML 1.1\n---\n",
    "---\n",
    "...\n",
    "? ",
    "\0",
    "\ufeff",
    "\u2028",
    "\x85",
    "é",
    "🤖",
    "1e999",
    "-.inf",
    ".nan",
    "0x7fffffffffffffff",
    "1_000",
    "0o17",
    "12:30:45",
    "2026-11-21",
    "yes",
    "null",
    "~",
    "=",
]
VALUES: list[Any] = [
    None,
    True,
    False,
    0,
    -1,
    1,
    2,
    10**30,
    -(10**30),
    2**63,
    0.0,
    -0.0,
    1e-308,
    1e308,
    float("inf"),
    float("-inf"),
    float("nan"),
    "",
    " ",
    "t",
    "sin(t)",
    "1/t",
    "__import__('os')",
    "t**t**t",
    "9**9**9**9",
    "(" * 150,
    "exp(exp(exp(t)))",
    "x" * 300,
    "../../etc/passwd",
    "/dev/null",
    "a/b",
    "\u202e",
    "\ud7ff",
    [],
    {},
    [[]],
    [{}],
    [None],
    {"a": {"b": {"c": 1}}},
    [1] * 2000,
    [[0.0, 0.0]] * 300,
    "apd_smc",
    "vertices",
    {"law": "pd"},
    {"behavior": "chords"},
    "robots",
    [1, 2],
    [1, 2, 3],
    ["t", "t"],
    ["t/0", "0"],
    ["sqrt(-1)", "log(0)"],
    5000,
    1e6,
]


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
        lines[at : at + 1] = dice.choice(
            (
                [],
                [lines[at]] * 2,
                ["  " + lines[at]],
                [lines[at].lstrip()],
                [dice.choice(lines)],
                [lines[at]] * 500,
            )
        )
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
    _bytes,
    _bytes,
    _lines,
    _structure,
    _structure,
    _structure,
    _bomb,
)
