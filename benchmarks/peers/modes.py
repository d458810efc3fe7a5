"""The peers, the ways they are used here, and what differs from ours in what they compute: `modes.yaml`."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from ruamel.yaml import YAML

SIZES = (5, 50, 500)


class Mode(NamedTuple):
    """A way to use a peer.

    Attributes:
        peer: Whose adapter and environment.
        mode: What the adapter calls it.
        title: What readers do.
        rigid: Whether it is rigid bodies under control: whether it is to be compared as such.
        kind: The kind of our robots that take turns with it.
        axes: In the plane or in space.
        dynamics: What moves its robots.
        contacts: What touching does.
        control: What tells its robots where to go, and how often.
        precision: Of its numbers.
        sizes: Numbers of robots.
        many: Whether it flies many missions at once; ours then flies one on each core.
    """

    peer: str
    mode: str
    title: str
    rigid: bool
    kind: str
    axes: int
    dynamics: str
    contacts: str
    control: str
    precision: str
    sizes: tuple[int, ...] = SIZES
    many: bool = False


_FOUND = YAML(typ="safe").load(Path(__file__).with_suffix(".yaml"))
MODES = tuple(Mode(**one | {"sizes": tuple(one.get("sizes", SIZES))}) for one in _FOUND)
