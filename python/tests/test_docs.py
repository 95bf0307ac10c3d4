"""The blocks of every page run as they are printed, one after another."""

from __future__ import annotations

import pathlib
import re
from typing import Any

import pytest

for module in ("pandas", "xarray", "pyvista", "trimesh", "distributed"):
    pytest.importorskip(module)
DOCS = pathlib.Path(__file__).parents[1] / "docs"
PAGES = [*sorted(page for page in DOCS.glob("*.md") if page.stem != "api"), DOCS.parent / "README.md"]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
@pytest.mark.filterwarnings("ignore:This process:DeprecationWarning")
def test_the_blocks_of_a_page_run(page: pathlib.Path, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pyvista = pytest.importorskip("pyvista")
    # Whether a picture can be drawn is a question of the machine.
    monkeypatch.setattr(pyvista.Plotter, "show", lambda self: None)
    monkeypatch.chdir(tmp_path)
    # As a program that is run, or a notebook, is called.
    names: dict[str, Any] = {"__name__": "__main__"}
    blocks = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    assert blocks
    for block in blocks:
        exec(compile(block, page.name, "exec"), names)
    if "client" in names:
        names["client"].close()
        names["cluster"].close()
