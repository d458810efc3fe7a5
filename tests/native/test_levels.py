"""Levels of processors: which one a machine has, and that machine code of a level stays within it."""

import llvmlite.binding as llvm
import pytest

from escort_mj.native import levels
from escort_mj.native.levels import SHIPPED, level


@pytest.fixture(autouse=True)
def asked_again():
    level.cache_clear()
    yield
    level.cache_clear()


def machine(monkeypatch: pytest.MonkeyPatch, triple: str, features: set[str]) -> None:
    monkeypatch.setattr(llvm, "get_process_triple", lambda: triple)
    monkeypatch.setattr(llvm, "get_host_cpu_features", lambda: dict.fromkeys(features, True) | {"xop": False})


@pytest.mark.parametrize("expected", SHIPPED, ids=lambda each: each.name)
def test_a_machine_has_the_highest_level_of_which_it_has_everything(expected, monkeypatch) -> None:
    machine(monkeypatch, "x86_64-unknown-linux-gnu", {*expected.features, "aes"})
    assert level() == expected
    machine(monkeypatch, "x86_64-unknown-linux-gnu", set(expected.features) - {expected.features[-1]})
    level.cache_clear()
    assert level() != expected


def test_each_level_has_what_the_one_below_has() -> None:
    for higher, lower in zip(SHIPPED, SHIPPED[1:], strict=False):
        assert set(higher.features) > set(lower.features)


def test_another_architecture_is_its_own_level(monkeypatch) -> None:
    machine(monkeypatch, "aarch64-unknown-linux-gnu", {"neon", "fp-armv8"})
    assert level() == levels.Level("aarch64", "", ("fp-armv8", "neon"))
    assert level().flags == "+fp-armv8,+neon"


def test_machine_code_leaves_out_what_only_one_maker_has() -> None:
    assert all("-sse4a" in each.flags.split(",") for each in SHIPPED)
