"""What tests of wrong scenarios share."""

import pytest

from escort_mj.errors import ScenarioError
from escort_mj.scenario import parse_scenario


def assert_one_fault(text: str, path: str, words: str) -> None:
    """A text has one fault, at this key path, with these words in its message."""
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(text)
    (fault,) = caught.value.faults
    assert (fault.key, words in fault.message) == (path, True), (fault.key, fault.message)
