"""The notebook of the documentation shows what its cells give today."""

from __future__ import annotations

import base64
import importlib.util
import json
import re
from pathlib import Path
from typing import Any

import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"
NEEDED = ("nbformat", "nbclient", "ipykernel", "matplotlib", "pandas", "polars")


def contents(notebook: Any) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return of each cell its source, and what it shows but for the pixels of plots."""
    found = []
    for cell in notebook["cells"]:
        shown = []
        for output in cell.get("outputs", ()):
            assert output["output_type"] in ("execute_result", "display_data")
            for kind, text in sorted(output["data"].items()):
                is_picture = kind == "image/png"
                shown.append((kind, "" if is_picture else "".join(text).strip()))
        found.append(("".join(cell["source"]), shown))
    return found


@pytest.mark.thorough
def test_the_notebook_is_what_its_cells_give(tmp_path: Path) -> None:
    for name in NEEDED:
        pytest.importorskip(name)
    spec = importlib.util.spec_from_file_location("notebook", DOCS / "notebook.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.written(tmp_path / "notebook.ipynb")
    made = json.loads((tmp_path / "notebook.ipynb").read_text(encoding="utf-8"))
    kept = json.loads((DOCS / "notebook.ipynb").read_text(encoding="utf-8"))
    assert contents(made) == contents(kept), "run: python docs/notebook.py"


def test_the_notebook_shows_tables_a_tree_and_plots() -> None:
    notebook = json.loads((DOCS / "notebook.ipynb").read_text(encoding="utf-8"))
    outputs = [output["data"] for cell in notebook["cells"] for output in cell.get("outputs", ())]
    shown = ["".join(data.get("text/html", "")) for data in outputs]
    assert sum("<table>" in text for text in shown) == 2
    assert any("publish to take" in text for text in shown)
    assert sum("text/vnd.mermaid" in data for data in outputs) == 1
    plots = [base64.b64decode(data["image/png"]) for data in outputs if "image/png" in data]
    assert len(plots) == 3
    assert all(plot.startswith(b"\x89PNG") and len(plot) > 5_000 for plot in plots)
    text = json.dumps(notebook)
    assert not re.search(r"/tmp/|Error", text)
    # Each plot takes less than ten lines.
    for cell in notebook["cells"]:
        assert len("".join(cell["source"]).splitlines()) < 12
