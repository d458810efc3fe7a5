"""Text of a scenario that is built in Python: what the reader of files refuses, tables refuse as well."""

import re
import sys

import pytest
from pydantic import ValidationError

from escort_mj.components.parameters import TEXT
from escort_mj.scenario import Scenario
from escort_mj.scenario.reader.document import is_control


@pytest.mark.parametrize(
    "table",
    [
        {"description": "a\0b"},
        {"description": "a\x9b"},
        {"expect": [{"contacts": "none", "xfail": "a\x1b[m"}]},
    ],
)
def test_control_characters_are_refused(table: dict) -> None:
    with pytest.raises(ValidationError, match="String should match pattern"):
        Scenario.model_validate({"duration": 1.0, "robots": {"count": 2}, **table})


@pytest.mark.slow
def test_tables_and_files_allow_the_same_characters() -> None:
    every = [chr(code) for code in range(sys.maxunicode + 1) if not 0xD800 <= code < 0xE000]
    refused = {letter for letter in every if is_control(letter)}
    assert refused == set(every) - set(re.findall(TEXT[1:-2], "".join(every)))
