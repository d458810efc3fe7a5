"""The command line: thin; each command calls one function of the package and prints what came of it."""

from escort_mj.cli import listing, logs, pictures, runs, studies, tools, view
from escort_mj.cli.app import app

__all__ = ["app", "listing", "logs", "pictures", "runs", "studies", "tools", "view"]
