"""Arguments and options of commands, made from the signatures and docstrings of Python functions.

A parameter without a default is an argument, others are options. The docstring says what each means; what has
the same type or name in several commands is described here.
"""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from enum import StrEnum
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, get_args, get_origin

import typer

from escort_mj.cli import complete

PACKAGE = Path(__file__).parents[1]

# What commands are annotated with; KINDS says more of each.
ScenarioName = str
Source = str
RunFolder = Path
RunFolders = tuple[Path, ...]
ResultsFolder = Path
Texts = tuple[str, ...]
Overrides = tuple[str, ...]
Formats = tuple[str, ...]
FigureFormat = StrEnum("FigureFormat", ["png", "pdf", "svg"])
Count = int
Robots = int
Axes = int
NotNegative = float
Either = bool
"""An option that can be taken back: --x or --no-x."""

FOLDER = {"exists": True, "file_okay": False}
A_SCENARIO = {
    "help": "Scenario file, or name of a shipped scenario such as main.",
    "autocompletion": complete.scenarios,
}
A_STUDY = {
    "help": "Study file, or name of a shipped study such as studies/minute.",
    "autocompletion": complete.studies,
}
LOOK = "report.figures.drawing.look.look_of"
"""What figures look like is chosen by its parameters."""
REPEATED = ("Texts", "Overrides", "Sequence[str]", "Sequence[str | int]", "str | Sequence[str]")
KINDS: dict[str, tuple[Any, dict[str, Any]]] = {
    **{each.__name__: (each, {}) for each in (bool, int, float, str, Path)},
    **dict.fromkeys(REPEATED, (list[str], {})),
    **dict.fromkeys(("Scenario | Source", "ScenarioName"), (str, A_SCENARIO)),
    "AnyStudy": (str, A_STUDY),
    "str | os.PathLike[str]": (Path, {}),
    "str | float": (str, {}),
    "Either": (bool, {}),
    "Count": (int, {"min": 1}),
    "Finite": (float, {}),
    "NotNegative": (float, {"min": 0.0}),
    "Robots": (int, {"min": 2, "max": 1000}),
    "Axes": (int, {"min": 2, "max": 3}),
    "Formats": (list[FigureFormat], {}),
    "Source": (str, {"autocompletion": complete.runs_or_scenarios}),
    "RunFolder": (Path, {"help": "Run folder.", "autocompletion": complete.runs} | FOLDER),
    "RunFolders": (list[Path], {"autocompletion": complete.runs} | FOLDER),
    "ResultsFolder": (Path, {"autocompletion": complete.results} | FOLDER),
}
"""Of each type: what Typer takes it for, and the settings of such options."""

NAMES: dict[str, tuple[str, dict[str, Any]]] = {
    "overrides": (
        "--set KEY.PATH=VALUE",
        {"help": "Override a value; repeatable.", "autocompletion": complete.overrides},
    ),
    "plugins": ("--plugin FILE|NAME", {"help": "Python file or installed plugin; repeatable."}),
    "width": ("--width LENGTH", {}),
    "font": ("--font FAMILY", {}),
    "formats": ("--figure-format", {}),
    "laws": ("--laws LAW,...", {"autocompletion": complete.laws}),
    "outer": ("--outer LOOP,...", {"autocompletion": complete.outer_loops}),
    "paths": ("", {"autocompletion": complete.scenarios_or_studies}),
}
"""What options of these names are called, and what else holds for them in all commands."""

_ENTRY = re.compile(r"^ {4}(\w+): (.+(?:\n {5,}.+)*)", re.MULTILINE)
_LEFT_OUT = re.compile(r"; (?:None|empty) (?:for|to) (.*?)(?=\.(?:\s|$))")


class Parameter(NamedTuple):
    """A parameter of a function.

    Attributes:
        annotation: Its type, as the source writes it.
        default: Its default; `inspect.Parameter.empty` for none.
        meaning: What the docstring says of it; empty for nothing.
    """

    annotation: str
    default: Any
    meaning: str


def options(
    function: Callable[..., Any], like: str, flags: Mapping[str, str], choices: Mapping[str, Iterable[str]]
) -> list[inspect.Parameter]:
    """Return the parameters of a command, as Typer takes them.

    Args:
        function: Makes the command. `**given` stands for the parameters of the function that it is like.
        like: Path of that function in the package, such as `api.studies.sweep`; empty for none.
        flags: By name, what options are called, with a word for their value behind a space; an argument that
            may be left out is called so without dashes.
        choices: By name, the words that a parameter may be.
    """
    wanted: dict[str, Parameter] = {}
    theirs = dict(_described(like)) if like else {}
    said = _meanings(function)
    for parameter in inspect.signature(function).parameters.values():
        if parameter.kind is parameter.VAR_KEYWORD:
            wanted = theirs | wanted
            continue
        meaning = theirs[parameter.name].meaning if parameter.name in theirs else ""
        annotation = parameter.annotation
        if parameter.name in choices:
            annotation = f"Literal{list(choices[parameter.name])}"
        wanted[parameter.name] = Parameter(annotation, parameter.default, meaning)
    required = [name for name, one in wanted.items() if one.default is inspect.Parameter.empty]
    ordered = [*required, *(name for name in wanted if name not in required)]
    return [_option(name, wanted[name], said.get(name, ""), flags.get(name, "")) for name in ordered]


def plain(parameters: Sequence[inspect.Parameter], given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments of a command as functions take them: what can be repeated is a tuple."""
    several = {
        each.name for each in parameters if any(get_origin(one) is list for one in _types(each.annotation))
    }
    return {name: tuple(value or ()) if name in several else value for name, value in given.items()}


def _types(annotation: Any) -> tuple[Any, ...]:
    """The types that an option may have."""
    kind = get_args(annotation)[0]
    return kind, *get_args(kind)


def help_of(function: Callable[..., Any]) -> str:
    """Return what a docstring says before it describes arguments."""
    return (inspect.getdoc(function) or "").partition("\n\nArgs:")[0]


def _option(name: str, parameter: Parameter, said: str, flag: str) -> inspect.Parameter:
    """Return a parameter as Typer takes it."""
    annotation = parameter.annotation.removesuffix(" | None")
    kind, settings = KINDS.get(annotation) or (_literal(annotation), {})
    named, more = NAMES.get(name, ("", {}))
    settings = {"help": _in_words(parameter.meaning)} | settings | more
    if said:
        settings["help"] = _in_words(said)
    flag, _, metavar = (flag or named).partition(" ")
    required = parameter.default is inspect.Parameter.empty
    if annotation == "bool" and parameter.default is False and not flag:
        flag = f"--{name.replace('_', '-')}"
    if metavar:
        settings["metavar"] = metavar
    dashed = flag.startswith("--")
    about = typer.Option if dashed or not (required or flag) else typer.Argument
    default = None if parameter.default == () else parameter.default
    hint: Any = kind if required or default is not None else kind | None
    hint = Annotated[hint, about(*flag.split(",") * dashed, **settings)]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=hint)


def _literal(annotation: str) -> Any:
    """Return a type of texts from its source."""
    return Literal[ast.literal_eval(f"({annotation.removeprefix('Literal[').removesuffix(']')},)")]


def _in_words(meaning: str) -> str:
    """Return a description for people who type: what None stands for is the default."""
    return " ".join(_LEFT_OUT.sub(r" [default: \1]", meaning).replace("`", "").split())


def _meanings(function: Callable[..., Any]) -> dict[str, str]:
    return dict(_ENTRY.findall((inspect.getdoc(function) or "").partition("\n\nArgs:")[2]))


@cache
def _functions(module: str) -> dict[str, ast.FunctionDef]:
    """The functions of a module by name; it is read, since to import it takes long."""
    file = PACKAGE.joinpath(*module.split("."))
    text = (file / "__init__.py" if file.is_dir() else file.with_suffix(".py")).read_text(encoding="utf-8")
    return {each.name: each for each in ast.parse(text).body if isinstance(each, ast.FunctionDef)}


def _described(path: str) -> Iterator[tuple[str, Parameter]]:
    """The parameters of a function of the package, but what it calls with its progress."""
    module, _, name = path.rpartition(".")
    functions = _functions(module)
    arguments = functions[name].args
    texts = {each: _ENTRY.findall(ast.get_docstring(one) or "") for each, one in functions.items()}
    said = dict(texts[name])
    first = [None] * (len(arguments.args) - len(arguments.defaults))
    named = [*arguments.args, *arguments.kwonlyargs]
    for each, value in zip(named, [*first, *arguments.defaults, *arguments.kw_defaults], strict=True):
        if each.arg == "progress" or each.annotation is None:
            continue
        meaning = said.get(each.arg, "")
        if other := re.match(r"As for `(\w+)`", meaning):
            meaning = dict(texts[other[1]])[each.arg]
        default = inspect.Parameter.empty if value is None else ast.literal_eval(value)
        yield each.arg, Parameter(ast.unparse(each.annotation), default, meaning)


def _shared(json: bool = False, quiet: bool = False, verbose: bool = False) -> None:
    """Declare the options that commands share.

    Args:
        json: Print one JSON document instead of text.
        quiet: Print errors and failed verdicts only.
        verbose: Print each stage with its duration, and the traceback of internal errors.
    """


SHARED = options(_shared, "", {"quiet": "--quiet,-q", "verbose": "--verbose,-v"}, {})
