"""One mission after another."""

import pytest

from escort_mj.environments.seeds import Seeds
from escort_mj.errors import UsageError


def test_without_a_seed_the_generator_goes_on() -> None:
    seeds = Seeds(7)
    first = [seeds.next() for _ in range(4)]
    assert first[0] == 7 and len(set(first)) == 4
    assert [seeds.next(7), *(seeds.next() for _ in range(3))] == first
    assert seeds.next(8) == 8 and seeds.next() not in first


def test_a_seed_that_cannot_be_leaves_the_generator_as_it_was() -> None:
    seeds, same = Seeds(7), Seeds(7)
    with pytest.raises(UsageError, match="seed: found -1; expected a whole number of at least 0"):
        seeds.next(-1)
    assert [seeds.next(), seeds.next()] == [same.next(), same.next()]
