import json
import sys
import warnings
from pathlib import Path

import jsonschema
import pytest
from hypothesis import given
from hypothesis import strategies as st

from escort_mj.components.parameters import Parameters
from escort_mj.errors import ScenarioError
from escort_mj.recognize import scenarios_in
from escort_mj.scenario import Scenario, dump_scenario, load_file, parse_scenario
from escort_mj.scenario.kinds import NAME_KEYS
from escort_mj.scenario.reader.document import SMALLEST, read_document
from escort_mj.scenario.reader.dump import flow, short_dump
from escort_mj.scenario.reader.plain import tuples

SCENARIOS = Path(__file__).parents[3] / "scenarios"
SHIPPED = list(scenarios_in(SCENARIOS))

bounds = st.floats(-Parameters.largest, Parameters.largest).filter(lambda x: x == 0.0 or abs(x) >= SMALLEST)
numbers = st.floats(-1e6, 1e6).map(lambda number: 0.0 if abs(number) < SMALLEST else number)
expressions = st.sampled_from(["t", "3 + 0.1*t", "sin(0.1*t)", "-t**2/1e6"])
names = st.text(
    st.characters(exclude_characters="/\\\ufffe\uffff", exclude_categories=("Cs", "Cc", "Zs")),
    min_size=1,
    max_size=20,
)

TEXT = st.characters(
    exclude_categories=("Cs", "Cc"), include_characters="\n\t", exclude_characters="\ufffe\uffff"
)


@st.composite
def scenarios(draw: st.DrawFn) -> Scenario:
    axes = draw(st.sampled_from([2, 3]))
    vector = st.tuples(*[numbers] * axes)
    data = dict(
        name="n" + draw(names),
        description=draw(st.text(TEXT, max_size=80)),
        seed=draw(st.integers(0, 2**53 - 1)),
        duration=draw(st.floats(0.1, 1e6)),
        axes=axes,
        target={"position": draw(st.none() | st.tuples(*[numbers | expressions] * axes))},
        robots={"positions": draw(st.none() | st.lists(vector, min_size=1, max_size=3))},
        obstacles=[{"position": draw(vector), "radius": draw(st.floats(1e-3, 1e3))}],
        mission={"max_speed": draw(st.none() | st.floats(1e-6, 1e6))},
        controller={"law": draw(st.sampled_from(["apd_smc", "asmc"])), "slope": draw(st.floats(1e-3, 1e3))},
        expect=[{"metric": "contacts", "at_most": draw(bounds)}],
    )
    return Scenario.model_validate(data)


@given(scenarios())
def test_what_is_written_reads_back_the_same(scenario: Scenario):
    """Equal to the last bit; what the checks between keys say of such wild scenarios does not matter here."""
    data = read_document(dump_scenario(scenario), "dump").data
    assert Scenario.model_validate_json(json.dumps(data), strict=True) == scenario
    short = read_document(short_dump(scenario), "short").data
    assert Scenario.model_validate_json(json.dumps(short), strict=True) == scenario


def test_an_interrupt_that_hits_pydantic_writes_no_warning():
    """It comes again a moment later, see `stopping`."""
    scenario = load_file("scenarios/main.yaml")

    def interrupt(frame, event, argument):
        if frame.f_code.co_name == "kind_of":
            raise KeyboardInterrupt

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sys.settrace(interrupt)
        try:
            assert dump_scenario(scenario)
        finally:
            sys.settrace(None)


def test_the_short_form_has_only_what_differs():
    text = "{name: x, robots: {count: 3, mass: 1.0}, controller: {law: pd}, mission: {behaviors: [surface]}}"
    scenario = parse_scenario(text)
    assert read_document(short_dump(scenario), "short").data == {
        "version": 1,
        "name": "x",
        "seed": 0,
        "robots": {"count": 3},
        "controller": {"law": "pd"},
        "mission": {"behaviors": [{"behavior": "surface"}]},
    }


def test_a_table_of_defaults_in_a_list_reads_back_the_same():
    scenario = parse_scenario("opponents: [{policy: straight}, {name: other}]\nduration: 6\n")
    assert parse_scenario(short_dump(scenario)) == scenario


def test_it_is_complete_and_easy_to_read():
    text = dump_scenario(parse_scenario("controller: asmc\nrobots: {positions: [[8, 0], [-8, 0]]}\n"))
    assert "robots:\n  count: null\n" in text
    assert "  positions:\n    - [8.0, 0.0]\n    - [-8.0, 0.0]\n" in text
    assert "controller:\n  law: asmc\n  slope: 20.0\n" in text
    assert "    - behavior: vertices\n      gain: 0.8\n" in text
    assert text.startswith("version: 1\nname: mission\n")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.1, "0.1"),
        (1e22, "1e+22"),
        (float("-inf"), "-.inf"),
        (True, "true"),
        ("word", "word"),
        ("null", '"null"'),
        ("yes", "yes"),
        ("1e3", '"1e3"'),
        ('a "b"\n\u200b\u2028é😀', '"a \\"b\\"\\n\\U0000200b\\U00002028é😀"'),
        ({"a": [1, None]}, '{"a": [1, null]}'),
    ],
)
def test_values_in_one_line(value: object, text: str):
    assert flow(value) == text
    assert read_document(text, "text").data == value


def test_the_schema_in_the_repository_is_current(schema):
    stored = json.loads((SCENARIOS / "schema.json").read_text())
    assert stored == schema, "run: escort-mj schema > scenarios/schema.json"


def test_the_schema_is_one_and_describes_every_key(schema):
    jsonschema.Draft202012Validator.check_schema(schema)
    for table in [schema, *schema["$defs"].values()]:
        for key, value in table["properties"].items():
            described = "description" in value or "$ref" in value  # a table describes itself
            assert described or key in NAME_KEYS, f"{table['title']}.{key} has no description"


@pytest.fixture(scope="module")
def validator(schema) -> jsonschema.Draft202012Validator:
    return jsonschema.Draft202012Validator(schema)


OF_EACH = "main case1_3d two_laws squeeze mixed lidar lossy swap gusts depot intruders supervised".split()
"""Shipped scenarios that have what others have, too."""


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, id=path.stem, marks=() if path.stem in OF_EACH else pytest.mark.slow)
        for path in SHIPPED
    ],
)
def test_what_ships_reads_back_the_same_in_both_forms(path: Path):
    scenario = load_file(path)
    assert parse_scenario(dump_scenario(scenario)) == scenario
    data = read_document(short_dump(scenario), str(path)).data
    assert type(scenario).model_validate(tuples(data), strict=True) == scenario


def test_what_ships_follows_the_schema(validator: jsonschema.Draft202012Validator):
    for path in SHIPPED:
        data = read_document(path.read_text(), str(path)).data
        validator.validate(data)
        assert data["name"] == path.stem and data["description"]


def test_the_schema_refuses_what_the_loader_refuses(validator: jsonschema.Draft202012Validator):
    for text in ("durration: 3", "robots: {mass: -1}", "controller: lqr", "mission: {behaviors: [chord]}"):
        with pytest.raises(jsonschema.ValidationError):
            validator.validate(read_document(text, "text").data)
        with pytest.raises(ScenarioError):
            parse_scenario(text)
