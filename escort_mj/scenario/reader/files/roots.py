"""The folder that the files of a scenario lie in: its own, or a root that it declares."""

from __future__ import annotations

import os
from pathlib import Path as FilePath
from typing import Any, NamedTuple

from escort_mj.scenario.findings import Finding, shown

KEY, HERE = "root", "."


class Roots(NamedTuple):
    """Where files of a scenario are looked for, and what they must be inside of.

    Attributes:
        folder: The scenario's folder: paths begin there.
        root: What files must be in, or below.
    """

    folder: FilePath
    root: FilePath

    def outside(self, file: FilePath) -> str:
        """Return why a file may not be read, with the root that would allow it; empty if it may."""
        place = os.path.realpath(file)
        if FilePath(place).is_relative_to(self.root.resolve()):
            return ""
        common = os.path.commonpath([os.path.realpath(self.folder), os.path.dirname(place)])
        needed = os.path.relpath(common, os.path.realpath(self.folder))
        said = (
            f"the root {os.path.relpath(self.root, self.folder)}"
            if self.declared
            else "the scenario's folder"
        )
        return f"leads out of {said}; the key root of the scenario allows it: root: {needed}"

    @property
    def declared(self) -> bool:
        """Whether the scenario declares a root."""
        return self.root != self.folder


def take_root(data: dict[str, Any], folder: FilePath) -> tuple[dict[str, Any], Roots, list[Finding]]:
    """Return plain data without the root that it declares, which has served once its files are read.

    Args:
        data: What a scenario says; it is not changed.
        folder: The scenario's folder.

    Returns:
        The data, where files are looked for, and what is wrong with the root.
    """
    written = data.get(KEY, HERE)
    if not isinstance(written, str):
        words = f"found {shown(written)}; expected the path of a folder, such as .."
    elif written == HERE:
        return data, Roots(folder, folder), []
    elif written and os.path.isdir(root := folder / written):
        return data | {KEY: HERE}, Roots(folder, root), []
    else:
        words = f"found {shown(written)}; there is no such folder, seen from the scenario's"
    return data, Roots(folder, folder), [Finding((KEY,), words)]
