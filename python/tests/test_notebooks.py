"""The notebooks run from top to bottom, and show their figures."""

from __future__ import annotations

import pytest

from conftest import ROOT

nbformat = pytest.importorskip("nbformat")
nbclient = pytest.importorskip("nbclient")
pytest.importorskip("ipykernel")

NOTEBOOKS = ROOT / "python" / "notebooks"


@pytest.mark.parametrize(("name", "figures"), [("paper_study", 3), ("missing_effect", 5), ("fleet", 1)])
def test_a_notebook_runs_and_shows_its_figures(name: str, figures: int) -> None:
    notebook = nbformat.read(NOTEBOOKS / f"{name}.ipynb", as_version=4)
    client = nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(NOTEBOOKS)}})
    client.execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    shown = [output["data"] for output in outputs if "data" in output]
    drawn = [data for data in shown if "image/svg+xml" in data or "<svg" in str(data.get("text/html", ""))]
    assert len(drawn) == figures
    assert not any("traceback" in output for output in outputs)


def test_notebooks_are_kept_without_what_a_run_leaves() -> None:
    found = sorted(NOTEBOOKS.glob("*.ipynb"))
    assert len(found) == 3
    for path in found:
        for cell in nbformat.read(path, as_version=4).cells:
            assert not cell.get("outputs") and cell.get("execution_count") is None, path
