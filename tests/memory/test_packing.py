"""Packing: each component gives the values of its own parameters, and together they give all."""

from itertools import combinations

from escort_mj.memory.layout import Plan
from escort_mj.memory.packing import _functions
from escort_mj.native.fields import Fields, declared
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.schema.scenario import Scenario

GIVEN_APART = {
    "parameters",  # blocks of the components that the others give
    *("step_stretches", "distances_asked"),  # by what expectations ask
    *("stride", "extra", "stretches", "truth", "lyapunov"),  # the record
    *("watched_group", "watched_alone", "watched_radius", "exact_within"),
}


def test_components_give_the_values_of_their_own_parameters() -> None:
    setup = Mission(Scenario()).setup
    given = {owner: set(owner.packed(setup)) for owner in Plan.__bases__ if issubclass(owner, Fields)}
    for owner, names in given.items():
        assert names <= set(declared(owner)), owner
    for one, other in combinations(given.values(), 2):
        assert not one & other
    given_together = GIVEN_APART | set(_functions(setup))
    assert set().union(*given.values()) == set(declared(Plan)) - given_together
