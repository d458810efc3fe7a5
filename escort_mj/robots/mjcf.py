"""Robots from files: any MJCF model that can be pushed, and the models of MuJoCo's Menagerie."""

from abc import abstractmethod
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from escort_mj.errors import RobotError
from escort_mj.robots.modeled import DriveKeys, ModeledKind, Source

INSTALL = "pip install 'escort-mj[menagerie]'"


def _by_name(value: Any) -> Any:
    """Let `wheels` stand for `{kind: wheels}`."""
    return {"kind": value} if isinstance(value, str) else value


LONGEST_NAME = 200  # letters
Name = Annotated[str, Field(min_length=1, max_length=LONGEST_NAME)]
Digest = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
Drive = Annotated[DriveKeys, BeforeValidator(_by_name, json_schema_input_type=str | DriveKeys)]


class FileKind(ModeledKind):
    """A robot from a file: mass and actuators are the file's."""

    body: Name | None = None
    """Name of the body that the law moves; null: the only one that can move."""
    drive: Drive = DriveKeys.model_construct()
    """Drive of the robot: a name, or a table; null values are determined from the effect of the actuators on
    the body that the law moves."""
    sha256: Digest | None = None
    """Required SHA-256 digest of the model and its assets; null: any. Every run writes the digest into its
    stored scenario."""

    @abstractmethod
    def place(self) -> tuple[Path, Path | None]:
        """Return where the file is, and the folder that all of it is inside of, None where a digest vouches.

        Raises:
            RobotError: If there is none.
        """

    def source(self, mass: float, radius: float) -> Source:
        """Return the file and how it is to be read; mass and radius are its own."""
        return self.asked_for(*self.place())

    def asked_for(self, file: Path, folder: Path | None) -> Source:
        """Return a file and how it is to be read.

        Args:
            file: Where it is.
            folder: What all of it is inside of; None where a digest vouches.
        """
        inside = "" if folder is None else str(folder)
        drive = self.drive.model_dump_json()
        return Source("", str(file), inside, self.sha256 or "", self.body or "", drive, self.shown)

    @property
    def shown(self) -> str:
        """What messages call the file."""
        raise NotImplementedError


class Mjcf(FileKind):
    """A robot from an MJCF file in the scenario's folder: any model whose actuators can move it."""

    kind: Literal["mjcf"] = "mjcf"
    file: Annotated[str, Field(min_length=1, max_length=4096)]
    """Path of the MJCF file, relative to the scenario's folder."""

    @property
    def shown(self) -> str:
        """What messages call it."""
        return Path(self.file).name

    def place(self) -> tuple[Path, Path | None]:
        """Return the file; beside a digest it is where an earlier reading has found it."""
        return Path(self.file), None if self.sha256 else Path(self.file).parent


class Menagerie(FileKind):
    """A model from MuJoCo's Menagerie (package `mujoco-menagerie`); missions download nothing."""

    kind: Literal["menagerie"] = "menagerie"
    model: Name
    """Name of the model, such as `skydio_x2`."""

    @property
    def shown(self) -> str:
        """What messages call it."""
        return self.model

    def place(self) -> tuple[Path, Path | None]:
        """Return the model's file in the package's cache, or in the folder MENAGERIE_ROOT."""
        try:
            package: Any = import_module("mujoco_menagerie")
        except ImportError:
            raise RobotError(f"{self.model}: the Menagerie's package is not installed: {INSTALL}") from None
        try:
            robot = package.get(self.model)
        except package.MenagerieError as error:
            raise RobotError(f"{self.model}: {error}") from None
        cache = package.Cache()
        if cache.root is None and not cache.is_cached(robot):
            raise RobotError(
                f"{self.model}: is not on this machine, and no mission downloads anything; get it by "
                f"`mujoco-menagerie prefetch {self.model}`, or set MENAGERIE_ROOT to a folder that holds it"
            )
        try:
            folder = Path(cache.resolve(robot))
        except package.MenagerieError as error:
            raise RobotError(f"{self.model}: {' '.join(str(error).split())}") from None
        return folder / robot.entry(robot.default_model).file, folder
