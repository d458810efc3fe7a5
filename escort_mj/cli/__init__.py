"""The command line: thin; each command calls one function of the package and prints what came of it."""

from escort_mj.cli import benchmark, listing, logs, pictures, runs, studies, tools, view
from escort_mj.cli.app import app

__all__ = ["app", "benchmark", "listing", "logs", "pictures", "runs", "studies", "tools", "view"]
