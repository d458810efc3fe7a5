"""Messages that only say something."""

import pytest

from escort_mj.errors import Fault, ScenarioError, one_line


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("plain :: text ü 😀", "plain :: text ü 😀"),
        ("a\nb\r\nc\u2028d\te", "a b c d e"),
        ("::error::x", ": :error::x"),
        ("\n  ::error::x", "   : :error::x"),
        ("see ##[error]x", "see # #[error]x"),
        ("\x1b[2J\x9b2J\x07\x7f\0", "?[2J?2J???"),
        ("a\u202eb\u2066c\ud800d", "a?b?c?d"),
    ],
)
def test_one_line_gives_no_orders(text: str, line: str) -> None:
    assert one_line(text) == line


def test_every_fault_is_one_line() -> None:
    faults = [Fault("x\n::error::y", "a\nb", 1, 2, "::error::.yaml"), Fault("z")]
    assert str(ScenarioError(faults)) == ": :error::.yaml:1:2: a b: x ::error::y\nz"
