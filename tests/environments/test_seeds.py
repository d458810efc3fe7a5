"""One mission after another."""

from escort_mj.environments.seeds import Seeds


def test_without_a_seed_the_generator_goes_on() -> None:
    seeds = Seeds(7)
    first = [seeds.next() for _ in range(4)]
    assert first[0] == 7 and len(set(first)) == 4
    assert [seeds.next(7), *(seeds.next() for _ in range(3))] == first
    assert seeds.next(8) == 8 and seeds.next() not in first
