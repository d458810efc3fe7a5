"""Missions, and wrong inputs, in files beside the tests: these with words of the one error that they raise.

A file is a list of tables; before it may stand a text with which each input begins, or that it changes.
In the words of an error, `...` stands for any others.
"""

import re
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML


def documents(path: Path) -> list[Any]:
    """Return all that a file holds."""
    return list(YAML(typ="safe").load_all(path))


def read(path: Path) -> Any:
    """Return what a file holds; the last document, where a text stands before it."""
    return documents(path)[-1]


def missions(test: str) -> dict[str, Any]:
    """Return the missions of a test, by their names, from `missions.yaml` beside it."""
    path = Path(test)
    found: dict[str, Any] = read(path.with_name("missions.yaml"))[path.stem.removeprefix("test_")]
    return found


def wrong(folder: Path) -> list[Any]:
    """Return the wrong inputs of all files of a folder, as parameters of a test."""
    found = []
    for path in sorted(folder.glob("*.yaml")):
        *heads, cases = documents(path)
        for number, case in enumerate(cases):
            text = "".join([*heads, case.get("text", "")])
            if "change" in case:
                assert case["change"][0] in text, case
                text = text.replace(*case["change"])
            name = f"{path.stem}-{case.get('what', number)}"
            found.append(pytest.param({**case, "text": text}, id=name))
    assert found, folder
    return found


def is_said(found: object, wanted: str) -> bool:
    """Whether an error begins with the first words, and has the others in this order."""
    pattern = ".*".join(re.escape(words) for words in re.split(r" ?\.\.\. ?", wanted))
    return re.match(pattern, str(found), re.DOTALL) is not None


def assert_said(found: object, wanted: str) -> None:
    """An error has these words."""
    assert is_said(found, wanted), f"{found}\nlacks: {wanted}"
