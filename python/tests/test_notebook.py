"""The notebook in `examples/` runs as a reader would run it, and shows what it promises."""

from __future__ import annotations

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOK = Path(__file__).parents[2] / "examples" / "ringwing.ipynb"


@pytest.fixture(scope="module")
def executed(tmp_path_factory: pytest.TempPathFactory) -> nbformat.NotebookNode:
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    folder = tmp_path_factory.mktemp("notebook")
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(folder)}}).execute()
    return notebook


def test_every_cell_runs_and_the_pictures_are_there(executed: nbformat.NotebookNode) -> None:
    outputs = [output for cell in executed.cells if cell.cell_type == "code" for output in cell.outputs]
    pictures = [output for output in outputs if "image/png" in output.get("data", {})]
    assert len(pictures) == 4
    assert all(output.get("name") != "stderr" for output in outputs), outputs


def test_the_text_that_the_notebook_shows_is_what_it_computes(executed: nbformat.NotebookNode) -> None:
    def text(notebook: nbformat.NotebookNode) -> str:
        outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
        # How a kernel cuts its output into pieces depends on time.
        return "".join(output["text"] for output in outputs if output.output_type == "stream")

    assert text(executed) == text(nbformat.read(NOTEBOOK, as_version=4)) != ""
