import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from escort_mj.errors import ScenarioError
from escort_mj.scenario.reader.document import SMALLEST, plain_scalar, read_document
from escort_mj.scenario.reader.load import scenario_of


def faults(text: str) -> list[str]:
    with pytest.raises(ScenarioError) as caught:
        read_document(text, "s.yaml")
    return [str(fault) for fault in caught.value.faults]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 0.001),
        ("-.5", -0.5),
        ("1.", 1.0),
        ("+3", 3),
        ("012", 12),
        ("0x1F", 31),
        ("0o17", 15),
        ("no", "no"),
        ("yes", "yes"),
        ("12:30:00", "12:30:00"),
        ("2020-01-01", "2020-01-01"),
        ("1_000", "1_000"),
        ("true", True),
        ("False", False),
        ("~", None),
        ("", None),
        ("null", None),
        ("-.inf", -math.inf),
        ("<<", "<<"),
        ("3 + 0.1*t", "3 + 0.1*t"),
        ("9" * 5000, "9" * 5000),
    ],
)
def test_plain_words_mean_what_yaml_1_2_says(text: str, value: object):
    found = plain_scalar(text)
    assert found == value
    assert type(found) is type(value)


def test_nan():
    assert math.isnan(plain_scalar(".nan"))


LETTERS = st.characters(
    exclude_categories=("Cs", "Cc"),
    include_characters="\n\t",
    exclude_characters="\ufffe\uffff",
)

json_values = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(10**18), 10**18)
    | st.floats(allow_nan=False, allow_infinity=False).filter(lambda x: not 0.0 < abs(x) < SMALLEST)
    | st.text(LETTERS, max_size=20),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text("abcxyz_", max_size=8), inner, max_size=4)
    ),
    max_leaves=12,
)


@given(st.dictionaries(st.text("abcxyz_", max_size=8), json_values, max_size=4))
def test_json_reads_as_itself(data: dict):
    assert read_document(json.dumps(data), "json").data == data


def test_a_pair_of_surrogates_is_the_character_that_json_means():
    assert read_document('{"\\ud83d\\ude00": "\\ud83d\\ude00"}', "json").data == {"\U0001f600": "\U0001f600"}
    (alone,) = faults('["\\ud83d"]')
    assert "found the character U+D83D" in alone


@pytest.mark.parametrize("number", ["5e-324", "-1e-310", "1e-300", "9.9e-38"])
def test_a_number_too_small_for_mujocos_reader_is_refused(number: str):
    (fault,) = faults(f"a: [0.0, 1e-37, {number}]")
    wanted = f"found {float(number)!r}; expected 0 or a number of at least 1e-37 in size"
    assert fault == f"s.yaml:1:17: a[2]: {wanted}"


def test_places():
    document = read_document("a: 1\nb:\n  - {c: x}\n  - 2\n", "s.yaml")
    assert document.data == {"a": 1, "b": [{"c": "x"}, 2]}
    assert document.place(("a",)) == ("s.yaml", 1, 4)
    assert document.place(("a",), at_key=True) == ("s.yaml", 1, 1)
    assert document.place(("b", 0, "c")) == ("s.yaml", 3, 9)
    assert document.place(("b", 0, "c"), at_key=True) == ("s.yaml", 3, 6)
    assert document.place(("b", 1)) == ("s.yaml", 4, 5)
    assert document.place(("b", 0, "missing")) == ("s.yaml", 3, 5)
    assert document.place(("nowhere", "at", "all")) == ("s.yaml", 1, 1)


def test_every_fault_at_once():
    assert faults("a: 1\na: 2\nb: !!set {x}\nc: &k 3\nb: 4\n") == [
        's.yaml:2:1: a: found the key "a" twice; it stands in line 1 already',
        's.yaml:3:4: b: found the tag "!!set"; tags are not allowed, leave it out',
        "s.yaml:4:4: c: found the anchor &k; write each value out",
        's.yaml:5:1: b: found the key "b" twice; it stands in line 3 already',
    ]


@pytest.mark.parametrize(
    "text",
    ["[" * 50_000, "- " * 300, "{a: " * 300, "a:\n" + "".join(" " * k + "a:\n" for k in range(1, 300))],
)
def test_deep_nesting_is_refused(text: str):
    (fault,) = faults(text)
    assert "levels of nesting" in fault


ANY, PUNCTUATION = st.characters(exclude_categories=("Cs",)), "ab01:-[]{},&*!|>'\"#%@`?\n \t"


@given(st.text(ANY, max_size=120) | st.text(PUNCTUATION, max_size=60))
def test_any_text_is_data_or_an_error(text: str):
    try:
        read_document(text, "text")
    except ScenarioError:
        pass


@pytest.mark.parametrize("code", [0x00, 0x07, 0x0D, 0x1B, 0x7F, 0x85, 0xFFFE])
def test_control_characters_are_refused_where_they_stand(code: int):
    letter = f"\\u{code:04X}"
    assert faults(f'name: good\ndeep:\n  - "a\\n\\tb{letter}c"\n"k{letter}": 1\n') == [
        f"s.yaml:3:5: deep[0]: found the character U+{code:04X}; allowed are line breaks, tabs and letters",
        f"s.yaml:4:1: found the character U+{code:04X}; allowed are line breaks, tabs and letters",
    ]


def test_line_breaks_tabs_and_any_script_are_text():
    text = "a\n\tb \u0645\u200c\u5b57 \U0001f600 $x^$ \\\\"
    assert read_document(json.dumps(text, ensure_ascii=False), "s.yaml").data == text


def test_a_list_that_holds_itself_is_nested_too_deeply() -> None:
    endless: list[object] = [1]
    endless.append(endless)
    with pytest.raises(ScenarioError, match="levels of nesting"):
        scenario_of({"name": "endless", "recording": endless})
