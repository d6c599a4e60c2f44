"""The recipes and the notebook run as they stand, where their packages are installed."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "plugin" / "python"
RECIPES = re.findall(r"^## (.+?)\n.*?```python\n(.*?)```", (FOLDER / "recipes.md").read_text(), re.M | re.S)
PACKAGES = ("trimesh", "meshio", "pybullet", "ray", "pyarrow")


def needs_polyscope():
    if sys.version_info[:2] == (3, 9):
        pytest.skip("the polyscope that pip installs for Python 3.9 needs Python 3.10")
    pytest.importorskip("polyscope")


def needs(text):
    for name in PACKAGES:
        if re.search(rf"\b{name}\b", text):
            pytest.importorskip(name)
    if "lazyccd.view" in text:
        needs_polyscope()
    if "lazyccd.sweep" in text:
        pytest.importorskip("ray")
    if "pybullet" in text or "sweep" in text:
        pytest.importorskip("pybullet")
        import lazyccd.pybullet

        if not lazyccd.pybullet._LIBRARY.exists():
            pytest.skip("the package was built without the plugin library")


def environment():
    return dict(os.environ, PYTHONPATH=os.pathsep.join(path for path in sys.path if path))


def test_the_page_has_recipes():
    assert len(RECIPES) >= 9


@pytest.mark.parametrize("title, text", RECIPES, ids=[title for title, _ in RECIPES])
def test_recipe(title, text, tmp_path):
    needs(text)
    subprocess.run([sys.executable, "-c", text], cwd=tmp_path, env=environment(), check=True, timeout=300)


def test_notebook(tmp_path):
    nbclient = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    for name in ("ipykernel", "trimesh"):
        pytest.importorskip(name)
    needs_polyscope()
    notebook = nbformat.read(str(FOLDER / "examples" / "contacts.ipynb"), as_version=4)
    client = nbclient.NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(tmp_path)}})
    client.execute(env=environment())
    pictures = [
        output
        for cell in notebook.cells
        for output in cell.get("outputs", [])
        if "image/png" in output.get("data", {})
    ]
    assert len(pictures) >= 2
