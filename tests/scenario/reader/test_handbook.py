"""The page of all keys is the schema's, whole and of today."""

import re
from typing import Any

from escort_mj.scenario.reader.handbook import handbook


def test_every_table_and_key_is_there_once_and_explained(schema: dict[str, Any]) -> None:
    page = handbook()
    sections = dict(zip(*[iter(re.split(r"^## (.+)$", page, flags=re.MULTILINE)[1:])] * 2, strict=True))
    assert sections.keys() == {"Scenario", *schema["$defs"]}
    for name, table in {"Scenario": schema, **schema["$defs"]}.items():
        rows = dict(re.findall(r"^\| `(\w+)` \|.*\| (.*) \|$", sections[name], flags=re.MULTILINE))
        keys = {key for key, value in table["properties"].items() if "const" not in value}
        assert rows.keys() == keys
        assert all(rows.values()), name
    assert set(re.findall(r"\(#(\w+)\)", page)) <= {name.lower() for name in sections}
