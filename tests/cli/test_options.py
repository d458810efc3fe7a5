"""Options are what the signatures and docstrings of Python functions say."""

from __future__ import annotations

import inspect
from typing import Any, Literal, get_args

import pytest
import typer

from escort_mj.api import studies
from escort_mj.cli import app
from escort_mj.cli.options import Either, Texts, options, plain

COMMANDS: Any = typer.main.get_command(app).commands  # type: ignore[attr-defined]
ALIKE = {name: getattr(studies, name) for name in ("compare", "falsify", "reproduce", "sweep", "tune")}


@pytest.mark.parametrize("name", ALIKE)
def test_a_command_has_the_parameters_of_its_function(name: str) -> None:
    parameters = inspect.signature(ALIKE[name]).parameters
    theirs = {one.name for one in parameters.values() if one.kind is not one.VAR_KEYWORD} - {"progress"}
    found = {option.name: option for option in COMMANDS[name].params}
    assert theirs <= set(found)
    assert set(found) - theirs <= {"json", "quiet", "verbose", "help", "video"}
    for key in theirs - {"figures"}:  # which the command draws unless it is told not to
        default = parameters[key].default
        assert found[key].required == (default is inspect.Parameter.empty)
        assert found[key].required or found[key].default == (None if default == () else default)


def test_words_are_those_of_the_docstring() -> None:
    found = {option.name: option.help for option in COMMANDS["sweep"].params}
    assert found["workers"] == "Number of parallel runs [default: one per core]."
    assert found["out"] == "Folder of results [default: renders/studies/NAME]."
    again = {option.name: option.help for option in COMMANDS["tune"].params}
    assert again["workers"] == "Number of processes [default: one per core]."


def grow(herd: str, many: int = 3, fast: bool = False, slow: Either = False, words: Texts = ()) -> None:
    """Grow a herd.

    Args:
        herd: Which one.
        many: How many
            there are; None for `all`. They stay.
        words: What is called.
    """


def test_a_function_becomes_options() -> None:
    flags = {"many": "--number N", "slow": "--slow,-s"}
    herd, many, fast, slow, words = options(grow, "", flags, {"herd": ["cows", "sheep"]})
    kinds = [get_args(each.annotation) for each in (herd, many, fast, slow, words)]
    assert [kind[0] for kind in kinds] == [Literal["cows", "sheep"], int, bool, bool, list[str] | None]
    assert (kinds[1][1].help, kinds[1][1].metavar) == ("How many there are [default: all]. They stay.", "N")
    assert plain([herd, words], {"herd": "cows", "words": None}) == {"herd": "cows", "words": ()}


def test_what_options_are_called() -> None:
    found = {option.name: (option.opts, option.secondary_opts) for option in COMMANDS["sweep"].params}
    assert (found["confirmed"], found["study"]) == ((["--yes"], []), (["study"], []))
    assert (found["overrides"], found["quiet"]) == ((["--set"], []), (["--quiet", "-q"], []))
    assert COMMANDS["tune"].params[-1].name == "verbose"
    drawn = {option.name: option.secondary_opts for option in COMMANDS["tune"].params}
    assert drawn["figures"] == ["--no-figures"]
