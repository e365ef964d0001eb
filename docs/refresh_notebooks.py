"""Run the notebooks of docs/notebooks, and rewrite their outputs.

    python docs/refresh_notebooks.py [NOTEBOOK ...]

A test runs them too, and compares what they show.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import nbformat
from jupyter_client.manager import KernelManager
from nbclient import NotebookClient

FOLDER = Path(__file__).resolve().parent / "notebooks"
NOTEBOOKS = tuple(sorted(FOLDER.glob("*.ipynb")))
_TIME_OUT_S = 300


def executed(path: Path, folder: Path, kernel: KernelManager | None = None) -> Any:
    """Run a notebook from its beginning.

    Args:
        path: the notebook.
        folder: where it runs, and writes its files.
        kernel: runs it in place of a new one, without the names that notebooks before it defined.

    Returns:
        The notebook with its outputs.

    Raises:
        nbclient.exceptions.CellExecutionError: a cell raises.
    """
    notebook = nbformat.read(path, as_version=4)
    if kernel is not None:
        notebook.cells.insert(0, nbformat.v4.new_code_cell(f"%reset -f\n%cd -q {folder}"))
    resources = {"metadata": {"path": str(folder)}}
    client = NotebookClient(
        notebook, kernel, timeout=_TIME_OUT_S, record_timing=False, resources=resources
    )
    client.execute()
    if kernel is not None:
        client.kc.stop_channels()
        del notebook.cells[0]
    notebook.metadata.pop("widgets", None)
    notebook.metadata["language_info"] = {"name": "python"}  # without the version of this machine's
    return notebook


def shown(notebook: Any) -> Iterator[str]:
    """The text that each cell shows; of a picture or an object only that there is one."""
    for cell in notebook.cells:
        for output in cell.get("outputs", ()):
            if output.output_type == "stream":
                yield output.text
            elif "image/png" in output.get("data", {}):
                yield "a picture\n"
            else:
                yield output.get("data", {}).get("text/plain", "") + "\n"


def main() -> None:
    """Refresh the notebooks named, or all."""
    for path in [Path(name).resolve() for name in sys.argv[1:]] or NOTEBOOKS:
        with tempfile.TemporaryDirectory() as folder:
            notebook = executed(path, Path(folder))
        nbformat.write(notebook, path)
        print(f"{path.name}: {path.stat().st_size / 1000:.0f} kB", flush=True)


if __name__ == "__main__":
    main()
