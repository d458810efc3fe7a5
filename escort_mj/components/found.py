"""The components that ship: whatever a folder of the package defines."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from pkgutil import iter_modules
from typing import TypeVar

from escort_mj.components.parameters import Member

T = TypeVar("T", bound=Member)
shipped = set[type[Member]]()
"""All components that ship."""


def found_in(package: str, path: Iterable[str], base: type[T]) -> tuple[type[T], ...]:
    """Return the components that the modules of a package define, in the order of the modules' names.

    Args:
        package: Its name.
        path: Its folders.
        base: What they derive from; classes that are no component by themselves have no name of their own.
    """
    modules = [import_module(f"{package}.{each.name}") for each in iter_modules(path)]
    found = tuple(
        member
        for module in modules
        for member in vars(module).values()
        if isinstance(member, type)
        and issubclass(member, base)
        and member.__module__ == module.__name__
        and member.own_name()
    )
    shipped.update(found)
    return found
