"""Print the lines of code by room, and hold the budgets of `[tool.size]` in pyproject.toml.

A line of code has more on it than space, a comment, a docstring or an import. The rooms are the packages of
`escort_mj` and its single modules together, the tests and the benchmarks. Exits with 1 if a room has more
lines than its budget, or none.
"""

import ast
import sys
import tokenize
import tomllib
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE, MODULES = "escort_mj", "modules"
OTHERS = ("tests", "benchmarks")
NO_CODE = {
    tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER,
}  # fmt: skip


def code_lines(path: Path) -> int:
    """Return how many lines of code a module has."""
    with tokenize.open(path) as file:
        tokens = [token for token in tokenize.generate_tokens(file.readline) if token.type not in NO_CODE]
    found = {line for token in tokens for line in range(token.start[0], token.end[0] + 1)}
    return len(found.difference(*map(_lines_of, _left_out(ast.parse(path.read_bytes())))))


def _left_out(tree: ast.Module) -> Iterator[ast.stmt]:
    """Yield what is no code: docstrings, those of attributes too, and imports."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield node
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            if isinstance(node.value.value, str):
                yield node


def _lines_of(node: ast.stmt) -> range:
    return range(node.lineno, (node.end_lineno or node.lineno) + 1)


def room_of(path: Path) -> str:
    """Return the room of a module."""
    first, second, *_ = path.relative_to(ROOT).parts
    return first if first != PACKAGE else MODULES if second.endswith(".py") else second


def sizes() -> dict[str, tuple[int, int]]:
    """Return the lines of code and all lines of each room, the largest room of the package first."""
    found: dict[str, tuple[int, int]] = defaultdict(lambda: (0, 0))
    for path in (path for top in (PACKAGE, *OTHERS) for path in (ROOT / top).rglob("*.py")):
        code, lines = found[room_of(path)]
        found[room_of(path)] = code + code_lines(path), lines + path.read_bytes().count(b"\n")
    return dict(sorted(found.items(), key=lambda room: (room[0] in OTHERS, -room[1][0])))


def main() -> int:
    """Print the table and what is wrong; return the exit code."""
    with (ROOT / "pyproject.toml").open("rb") as file:
        budgets: dict[str, int] = tomllib.load(file)["tool"]["size"]
    found = sizes()
    print(f"{'room':14}{'code':>8}{'budget':>8}{'all lines':>11}")
    for room, (code, lines) in found.items():
        print(f"{room:14}{code:8,}{budgets.get(room, 0):8,}{lines:11,}")
    package = [count for room, count in found.items() if room not in OTHERS]
    code, lines = (sum(column) for column in zip(*package, strict=True))
    print(f"{PACKAGE:14}{code:8,}{'':8}{lines:11,}")
    wrong = [
        f"{room}: found {code:,} lines of code; the budget is {budgets.get(room, 0):,}"
        for room, (code, _) in found.items()
        if code > budgets.get(room, 0)
    ]
    wrong += [f"{room}: has a budget, and there is no such room" for room in budgets.keys() - found.keys()]
    print(*wrong, sep="\n", file=sys.stderr, end="\n" * bool(wrong))
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
