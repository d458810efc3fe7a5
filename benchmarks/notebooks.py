"""`python -m benchmarks.notebooks`: run the notebooks of examples/ and store what they show."""

from __future__ import annotations

import tempfile
from pathlib import Path

import nbformat
from nbclient import NotebookClient

EXAMPLES = Path(__file__).parents[1] / "examples"


def main() -> None:
    """Run each notebook in an empty folder, and write it back with its output."""
    for path in sorted(EXAMPLES.glob("*.ipynb")):
        book = nbformat.read(path, as_version=4)
        with tempfile.TemporaryDirectory() as folder:
            NotebookClient(book, timeout=300, resources={"metadata": {"path": folder}}).execute()
        for cell in book.cells:
            cell.metadata.pop("execution", None)  # times of day
        book.metadata["language_info"] = {"name": "python"}
        nbformat.write(book, path)
        print(path.name, flush=True)


if __name__ == "__main__":
    main()
