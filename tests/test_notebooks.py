"""Every notebook runs from top to bottom, and is kept without its outputs."""

from __future__ import annotations

import asyncio
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

nbformat = pytest.importorskip("nbformat", reason="needs pip install 'gaitopt[notebook]'")
nbclient = pytest.importorskip("nbclient", reason="needs pip install 'gaitopt[notebook]'")

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))


def kernel_of_this_python(name: str) -> Any:
    """A kernel manager that runs this very interpreter, whichever kernels are registered."""
    from jupyter_client.kernelspec import KernelSpec, KernelSpecManager
    from jupyter_client.manager import AsyncKernelManager

    class ThisPython(KernelSpecManager):  # type: ignore[misc]
        def get_kernel_spec(self, kernel_name: str) -> KernelSpec:
            command = [sys.executable, "-m", "ipykernel_launcher", "-f", "{connection_file}"]
            return KernelSpec(argv=command, language="python", display_name=kernel_name)

    return AsyncKernelManager(kernel_name=name, kernel_spec_manager=ThisPython())


@pytest.fixture(scope="module")
def kernel(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """One kernel for all notebooks: to start it and to import everything takes seconds."""
    folder = tmp_path_factory.mktemp("jupyter")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("IPYTHONDIR", str(folder / "ipython"))
        patch.setenv("JUPYTER_RUNTIME_DIR", str(folder / "runtime"))
        manager = kernel_of_this_python("python3")
        yield manager
        if manager.has_kernel:
            asyncio.run(manager.shutdown_kernel(now=True))


@pytest.fixture
def executed(request: pytest.FixtureRequest, kernel: Any, tmp_path: Path) -> Any:
    """The notebook after all of its cells have run in an empty folder, with no name known."""
    notebook = nbformat.read(request.param, as_version=4)
    fresh = f"%reset -f\nimport os\nos.chdir({str(tmp_path)!r})\ndel os"
    notebook.cells.insert(0, nbformat.v4.new_code_cell(fresh))
    nbclient.NotebookClient(
        notebook, km=kernel, timeout=1200, resources={"metadata": {"path": str(tmp_path)}}
    ).execute()
    del notebook.cells[0]
    return notebook


def shown(notebook: Any) -> set[str]:
    """The kinds of output in a notebook."""
    outputs = [o for cell in notebook.cells for o in cell.get("outputs", [])]
    return {kind for o in outputs for kind in o.get("data", {o["output_type"]: None})}


@pytest.mark.parametrize("executed", NOTEBOOKS, indirect=True, ids=lambda path: path.stem)
def test_notebook_runs_and_shows_something(executed: Any) -> None:
    assert {"stream", "text/plain", "image/png", "text/html"} <= shown(executed)
    errors = [o for cell in executed.cells for o in cell.get("outputs", [])
              if o.get("name") == "stderr" or o["output_type"] == "error"]  # fmt: skip
    assert not errors


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_is_kept_without_outputs(path: Path) -> None:
    notebook = json.loads(path.read_text("utf-8"))
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == [] and cell["execution_count"] is None
    assert "version" not in notebook["metadata"].get("language_info", {})
    assert path.stat().st_size < 50_000


def test_there_is_a_notebook() -> None:
    assert NOTEBOOKS
