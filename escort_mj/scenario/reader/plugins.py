"""Plugins found and loaded: a Python file, or an installed package by the name of its entry point.

A plugin is code that the user chose to run: nothing is loaded that a scenario or a command does not name.
"""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import linecache
import os
import sys
import threading
import traceback
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

from pydantic import ValidationError

from escort_mj import stopping
from escort_mj.components.equations import Equations
from escort_mj.errors import PluginError
from escort_mj.metrics.metric import metrics_of
from escort_mj.plugin_calls import Trespass, confined, text_of
from escort_mj.robots import RobotKind
from escort_mj.scenario.findings import did_you_mean, listed
from escort_mj.scenario.kinds import TABLES, kind_of
from escort_mj.scenario.reader.method_calls import guard
from escort_mj.scenario.reader.plugin_shape import check_metric, check_shape
from escort_mj.scenario.schema.plugin_source import PluginSource

GROUP = "escort_mj.plugins"
"""Group of the entry points of installed plugins."""
DIGEST = 64  # hexadecimal digits


@dataclass(frozen=True)
class Plugin:
    """A plugin that is loaded.

    Attributes:
        source: Where it is, with the digest of its content.
        version: Of an installed package; empty for a file.
        members: The classes that it brings, by what they are.
    """

    source: PluginSource
    version: str
    members: tuple[Any, ...]

    @property
    def name(self) -> str:
        """What messages and records call it: the file's name, or the entry point's."""
        return Path(self.source.file).name if self.source.file else str(self.source.package)

    @property
    def identity(self) -> str:
        """Tells its content, for records."""
        digest = f"sha256 {self.source.sha256}"
        return f"{self.version} ({digest})" if self.version else digest

    def of(self, kind: type[Any]) -> list[Any]:
        """The members that derive from a base class, or the metrics."""
        return [
            member
            for member in self.members
            if isinstance(member, kind) or (isinstance(member, type) and issubclass(member, kind))
        ]


BASES = tuple(base for base in TABLES if base.of_plugins)
"""What members of a plugin derive from, beside functions that are metrics."""

_loaded: dict[tuple[str, str], Plugin] = {}  # by file or package, and digest
_loading = threading.RLock()  # a plugin may load scenarios while it is loaded


def placed_in(folder: Path, written: Any) -> Any:
    """Return a list of plugins with absolute paths; anything but a list is returned as it is.

    Args:
        folder: Where the paths begin: the current folder for a command, its own for a study.
        written: The value of the key `plugins`.
    """
    if not isinstance(written, list | tuple):
        return written
    return [_placed(folder, one) for one in written]


def _placed(folder: Path, one: Any) -> Any:
    if isinstance(one, str) and (one.endswith(".py") or "/" in one):
        return str((folder / one).absolute())
    if isinstance(one, dict) and isinstance(one.get("file"), str):
        return one | {"file": str((folder / one["file"]).absolute())}
    return one


def source_of(written: Any, folder: Path) -> PluginSource:
    """Where a plugin is that is named by a file or package, or by a table with one of the two.

    Args:
        written: As a scenario or a command names it.
        folder: Where paths of files begin.

    Raises:
        PluginError: If it names nothing.
    """
    if isinstance(written, str):
        key = "file" if written.endswith(".py") or "/" in written else "package"
        written = {key: written}
    if not isinstance(written, dict) or (written.get("file") is None) == (written.get("package") is None):
        raise PluginError("expected a Python file, such as own_law.py, or the name of an installed plugin")
    if unknown := [str(key) for key in written if key not in PluginSource.model_fields]:
        names = list(PluginSource.model_fields)
        raise PluginError(
            f"{unknown[0]} is not a key of a plugin; allowed are {listed(names)}"
            f"{did_you_mean(unknown[0], names)}"
        )
    file, digest = written.get("file"), written.get("sha256")
    if not all(each is None or isinstance(each, str) for each in written.values()):
        raise PluginError("file, package and sha256 of a plugin are texts")
    if digest is not None and len(digest) != DIGEST:
        raise PluginError(f"sha256 has {len(digest)} characters; a digest has {DIGEST}")
    if file is not None:
        if not file.endswith(".py"):
            raise PluginError(f"{file}: a plugin is a Python file, .py")
        file = str((folder / file).absolute())
    try:
        return PluginSource(file=file, package=written.get("package"), sha256=digest)
    except ValidationError as error:
        first = error.errors()[0]
        raise PluginError(
            f"{first['loc'][0]} of a plugin: {first['msg'][:1].lower()}{first['msg'][1:]}"
        ) from None


def load_plugin(source: PluginSource) -> Plugin:
    """Load a plugin, or find it loaded already.

    Raises:
        PluginError: If it is not there, is not what its digest says, cannot be loaded, or is no plugin.
    """
    with _loading:
        if source.file is not None:
            return _load_file(Path(source.file), source)
        return _load_package(str(source.package), source)


def _load_file(path: Path, source: PluginSource) -> Plugin:
    try:
        there = path.is_file()
    except OSError as error:
        raise PluginError(f"{str(path)[:80]}...: cannot be read: {error.strerror}") from None
    if not there:
        folder = path.parent
        names = [each.name for each in folder.glob("*.py")] if folder.is_dir() else []
        raise PluginError(f"{path}: there is no such file{did_you_mean(path.name, names, 0.75)}")
    try:
        content = path.read_bytes()
    except OSError as error:
        raise PluginError(f"{path}: cannot be read: {error.strerror}") from None
    digest = _same(hashlib.sha256(content).hexdigest(), source, str(path))
    known = _loaded.get((str(path), digest))
    if known is not None:
        return known
    name = f"escort_mj_plugin_{path.stem}_{digest[:12]}"
    loader = _Content(name, path, content)
    spec = importlib.util.spec_from_file_location(name, path, loader=loader)
    assert spec is not None, "there is one where a loader is given"
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    linecache.checkcache(str(path))
    for file in (
        str(path),
        os.path.realpath(path),
    ):  # else texts below parameters are looked for in the module
        inspect.modulesbyfile.pop(file, None)  # that was loaded from there before its content changed
    try:
        with _messages(str(path)), confined(str(path), loads=True):
            loader.exec_module(module)
            members = _members(module, str(path), name)
    except BaseException:
        del sys.modules[name]
        raise
    plugin = Plugin(source.model_copy(update={"sha256": digest}), "", members)
    return _keep((str(path), digest), plugin)


def _load_package(name: str, source: PluginSource) -> Plugin:
    from importlib.metadata import entry_points

    known = {each.name: each for each in entry_points(group=GROUP)}
    if name not in known:
        there = f"installed are {listed(sorted(known))}" if known else f"none is installed (group {GROUP})"
        raise PluginError(
            f"{name}: there is no installed plugin of that name; {there}{did_you_mean(name, known)}; "
            "a file is named with its suffix, .py"
        )
    entry = known[name]
    with _messages(name), confined(name, loads=True):
        module = entry.load()
    if not isinstance(module, ModuleType):
        raise PluginError(f"{name}: its entry point is {entry.value}; expected a module")
    digest = _same(_digest_of(module), source, name)
    found = _loaded.get((name, digest))
    if found is not None:
        return found
    version = entry.dist.version if entry.dist is not None else ""
    members = _members(module, name, module.__name__.partition(".")[0])
    return _keep((name, digest), Plugin(source.model_copy(update={"sha256": digest}), version, members))


def _keep(key: tuple[str, str], plugin: Plugin) -> Plugin:
    for member in plugin.of(Equations):
        member.digest = plugin.source.sha256
        guard(member, kind_of(member), left_out=member.equations())
    for kind in plugin.of(RobotKind):
        guard(kind, RobotKind)
    _loaded[key] = plugin
    return plugin


def _same(digest: str, source: PluginSource, name: str) -> str:
    """The digest, if it is the one that is wanted."""
    if source.sha256 not in (None, digest):
        raise PluginError(
            f"{name}: has changed: its sha256 is {digest[:12]}..., and {str(source.sha256)[:12]}... is asked "
            "for; take the key sha256 out to use it as it is"
        )
    return digest


def _digest_of(module: ModuleType) -> str:
    """Digest of a module's file, or of all Python files of a package."""
    file = Path(str(module.__file__))
    files = sorted(filter(Path.is_file, file.parent.rglob("*.py"))) if file.name == "__init__.py" else [file]
    digest = hashlib.sha256()
    for each in files:
        content = each.read_bytes()
        digest.update(f"{each.relative_to(file.parent).as_posix()}:{len(content)};".encode())
        digest.update(content)
    return digest.hexdigest()


class _Content(SourceFileLoader):
    """Runs the content that was read, whatever Python's own cache of compiled files holds."""

    def __init__(self, name: str, path: Path, content: bytes) -> None:
        super().__init__(name, str(path))
        self._content = content

    def get_code(self, fullname: str) -> CodeType:
        """The content, compiled."""
        with warnings.catch_warnings():
            warnings.simplefilter("error", SyntaxWarning)
            return self.source_to_code(self._content, self.path)


class _messages:  # noqa: N801 - a context manager, used like a function
    """Turns whatever happens while a plugin is imported into one message with its line."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        if error is None or (isinstance(error, KeyboardInterrupt) and stopping.is_users()):
            return
        words = text_of(error, self._name).strip()
        if isinstance(error, PluginError):
            raise PluginError(words if words.startswith(self._name) else f"{self._name}: {words}") from None
        if isinstance(error, SyntaxError):
            place = f"{error.filename or self._name}:{error.lineno or 0}:{error.offset or 0}"
            raise PluginError(f"{place}: this is not Python: {text_of(error.msg, self._name)}") from None
        frames = [frame for frame in traceback.extract_tb(trace) if frame.filename == self._name]
        words = words.partition("\n")[0]
        line = frames[-1].lineno if frames else _line_of(self._name, words)
        place = f"{self._name}:{line}" if line else self._name
        if isinstance(error, ImportError) and error.name and _beside(self._name, error.name):
            words += "; a plugin file stands alone: a plugin of several modules is an installed package"
        kind = "" if isinstance(error, Trespass) else f"{type(error).__name__}: "
        raise PluginError(f"{place}: {kind}{words}".removesuffix(": ")) from None


_SIGNS = {
    "standard stream": "std",
    "working directory": "chdir",
    "environment": "environ",
    "np.seterr": "seterr",
    "random": "random",
    "handles signals": "signal",
    "timer": "timer",
    "the interpreter": "sys.set",
    "of warnings": "warnings.",
}
"""What stands in a line that changes what the process shares, by what is said of it."""


def _line_of(file: str, words: str) -> int:
    """The first line of a plugin that seems to have done what was found afterwards, from 1; 0 for none."""
    signs = [sign for said, sign in _SIGNS.items() if said in words]
    if " replaces " in words and not signs:
        signs = [words.rpartition(".")[2]]
    lines = linecache.getlines(file)
    return next(
        (k for k, text in enumerate(lines, 1) if signs and signs[0] in text and "import" not in text[:7]), 0
    )


def _beside(file: str, module: str) -> bool:
    """Whether a module that cannot be imported lies beside a plugin's file."""
    return (Path(file).parent / f"{module.partition('.')[0]}.py").is_file()


def _members(module: ModuleType, name: str, home: str) -> tuple[Any, ...]:
    """What a module brings, checked.

    Args:
        module: What was imported.
        name: What to call it in messages.
        home: Its name, or that of the package: what comes from elsewhere is not its own.
    """
    for key, value in vars(module).items():
        if (
            key in {base.method for base in BASES}
            and isinstance(value, FunctionType)
            and value.__module__ == module.__name__
        ):
            line = value.__code__.co_firstlineno
            raise PluginError(f"{name}:{line}: {key} stands outside of a class: indent it by four spaces")
    metrics = metrics_of(module, home)
    found = list(_classes(module, home))
    if not found and not metrics:
        names = f"{listed([base.__name__ for base in BASES])} of escort_mj.plugins, and none is a @metric"
        strays = [
            key
            for key, value in vars(module).items()
            if isinstance(value, type) and value.__module__ == module.__name__
        ]
        stray = f" (found the class {strays[0]}, which derives from none of them)" if strays else ""
        raise PluginError(f"{name}: brings nothing: no class derives from {names}{stray}")
    for member in found:
        check_shape(member, name)
    for metric in metrics:
        check_metric(metric, name)
    return (*found, *metrics)


def _classes(module: ModuleType, home: str) -> Iterator[type[Any]]:
    """The classes of a module that a scenario can use, in the order in which they are written."""
    seen: set[type[Any]] = set()
    for key, value in vars(module).items():
        own = isinstance(value, type) and issubclass(value, BASES) and value not in BASES
        if own and not key.startswith("_") and value not in seen:
            if value.__module__ == home or value.__module__.startswith(f"{home}."):
                seen.add(value)
                yield value


def load_all(written: Sequence[Any], folder: Path) -> Iterator[Plugin | PluginError]:
    """Loads plugins one by one; gives the error in the place of one that cannot be loaded."""
    for each in written:
        try:
            yield load_plugin(source_of(each, folder))
        except PluginError as error:
            yield error
