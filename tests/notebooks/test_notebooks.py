"""The notebooks run as they stand, in an empty folder, in a kernel of this interpreter; and are committed without outputs."""

import os
import sys
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "docs/notebooks").glob("*.ipynb"))
pytestmark = pytest.mark.xdist_group("notebooks")


def run(path, folder, **client):
    """The notebook with its outputs; a cell that raises is an error."""
    book = nbformat.read(path, as_version=4)
    NotebookClient(book, timeout=250, kernel_name="python3", resources={"metadata": {"path": str(folder)}}, **client).execute()
    return book


def shown(book):
    """All that a reader sees below the cells, as text."""
    return "\n".join(str(output.get("text") or output.get("data")) for cell in book.cells for output in cell.get("outputs", ()))


def test_there_are_three():
    assert [path.stem for path in NOTEBOOKS] == ["campaign_to_requirement", "first_flight", "your_own_controller"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_as_it_stands(path, tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")])))
    book = run(path, tmp_path)
    text = shown(book)
    assert "image/png" in text and "text/html" in text, text
    assert str(tmp_path) not in text and sys.prefix not in text and "Traceback" not in text
    code = [cell for cell in book.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in code] == list(range(1, len(code) + 1))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_committed_without_outputs_and_leads_to_pages(path):
    book = nbformat.read(path, as_version=4)
    nbformat.validate(book)
    for cell in book.cells:
        assert not cell.get("outputs") and not cell.get("execution_count")
    assert book.metadata.kernelspec.name == "python3" and str(ROOT) not in path.read_text()
