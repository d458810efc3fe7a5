"""What is worked out once for all tests of scenarios."""

from typing import Any

import pytest

from escort_mj.scenario import json_schema


@pytest.fixture(scope="session")
def schema() -> dict[str, Any]:
    """The JSON schema of scenarios."""
    return json_schema()
