"""The notebooks of the documentation run, and show what they show."""

import nbformat
import pytest
from doc_blocks import Block, differs
from jupyter_client.manager import KernelManager
from mkdocs_hooks import notebook_markdown
from refresh_notebooks import NOTEBOOKS, executed, shown

REFRESH = "if the new output is right, run python docs/refresh_notebooks.py"


def test_there_are_four():
    assert [path.stem for path in NOTEBOOKS] == ["first-campaign", "own-manager", "rules", "sweep-with-salib"]


@pytest.fixture(scope="module")
def kernel():
    """Runs all notebooks: each imports the same modules and starts Java."""
    manager = KernelManager()
    yield manager
    if manager.has_kernel:
        manager.shutdown_kernel(now=True)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_it_runs_and_shows_what_it_showed(path, kernel, tmp_path):
    kept = list(shown(nbformat.read(path, as_version=4)))
    assert kept, "it was never run"
    for text, now in zip(kept, shown(executed(path, tmp_path, kernel)), strict=True):
        assert not differs(Block(path, 1, "text", {}, text), now, quick=False), f"{text}{now}{REFRESH}"


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_the_page_on_the_site_has_every_cell_and_output(path):
    notebook = nbformat.read(path, as_version=4)
    page = notebook_markdown(notebook)
    for cell in notebook.cells:
        assert cell.source in page
    assert page.count("data:image/png") == sum(text == "a picture\n" for text in shown(notebook))
    assert "<style" not in page
