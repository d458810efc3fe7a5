"""The memory of a mission: what components declare, laid out one behind the other."""

from itertools import pairwise

import numpy as np
import pytest

from escort_mj.components.views import BehaviorView, LawView
from escort_mj.memory.layout import LAYOUT, Plan, State, state_size
from escort_mj.memory.packing import pack
from escort_mj.memory.sampling import Sampling
from escort_mj.native.fields import Fields, Recorded, declared
from escort_mj.native.lanes import WIDTH
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.signals import SIGNALS, Signals


@pytest.mark.parametrize("kind", [Plan, State])
def test_every_field_has_a_unit_and_a_meaning(kind: type) -> None:
    for name, field in declared(kind).items():
        assert field.value is not None and field.value.unit and field.value.meaning, name
        assert not field.value.meaning.endswith("."), name


@pytest.mark.parametrize("kind", [Plan, State])
def test_components_declare_and_nothing_else(kind: type) -> None:
    assert "__annotations__" not in vars(kind)
    assert all(issubclass(base, Fields) and base.__doc__ for base in kind.__mro__[:-1])


def test_the_bases_stand_in_memory_in_their_order() -> None:
    owners = [declared(base) for base in State.__bases__]
    assert list(LAYOUT.fields[State]) == [name for fields in owners for name in fields]


def test_what_is_recorded_comes_first_and_the_samples_last() -> None:
    recorded = [name for name, field in declared(State).items() if isinstance(field.value, Recorded)]
    assert recorded == list(declared(Signals)) == [signal.name for signal in SIGNALS]
    assert list(declared(State))[: len(recorded)] == recorded
    assert recorded[0] == "time"
    assert list(declared(State))[-4:] == ["samples", "spare", "steps", "steps_spare"]


def test_arrays_lie_one_behind_the_other_in_whole_lanes() -> None:
    setup = Mission(Scenario()).setup
    plan = pack(setup, Sampling(stride=10, coordinates=10))
    header = {name: int(plan[field.place]) for name, field in LAYOUT.fields[State].items()}
    assert all(place % WIDTH == 0 for place in header.values())
    assert all(before <= after for before, after in pairwise(header.values()))
    assert header["q"] == WIDTH and header["v"] == 3 * WIDTH, "two rows of lanes for five robots' x and y"
    assert state_size(plan) == header["steps_spare"] + WIDTH
    in_plan = [field for field in LAYOUT.fields[Plan].values() if field.kind is np.ndarray]
    assert [int(plan[field.place]) for field in in_plan] == sorted(int(plan[f.place]) for f in in_plan)


@pytest.mark.parametrize("view", [LawView, BehaviorView])
def test_what_plugins_see_is_declared_alike(view: type) -> None:
    everything = declared(Plan) | declared(State)
    for name, field in declared(view).items():
        owner = everything[name]
        assert (field.kind, field.shape) == (owner.kind, owner.shape), name
