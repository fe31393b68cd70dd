"""Every block of Python of the pages and of the README runs, word for word."""

import shutil

import fmnet
import numpy as np
import pytest

from conftest import ROOT

pytestmark = pytest.mark.filterwarnings("ignore::fmnet.FmnetWarning")


def blocks(page):
    parts = (ROOT / page).read_text(encoding="utf-8").split("```python\n")[1:]
    return [part.split("```")[0] for part in parts]


@pytest.fixture
def workplace(demo, tmp_path, monkeypatch):
    """The files that the pages speak of, and what a reader has of his own."""
    source, target = demo
    # What a file is tells its content, not its name.
    for name in ["man.obj", "a.ply", "template.ply", "part.ply"]:
        shutil.copy(source, tmp_path / name)
    for name in ["woman.glb", "b.ply", "scan1.ply", "scan2.ply", "whole.ply"]:
        shutil.copy(target, tmp_path / name)
    shutil.copy(ROOT / "models" / "bodies" / "model.onnx", tmp_path / "bodies.onnx")
    monkeypatch.chdir(tmp_path)
    n, m = 2400, len(fmnet.Matcher(descriptor="shot", k=10).describe(target).faces)
    random = np.random.default_rng(0)
    return {
        "target_colors": random.random((n, 3)),
        "target_labels": random.integers(0, 9, n),
        "source_weights": random.random((n, 4)).astype(np.float32),
        "corner_uvs": random.random((m, 3, 2)),
        "truth": np.where(np.arange(n) < 1000, np.arange(n), -1),
    }


@pytest.mark.parametrize(
    "page, fewest", [("docs/python.md", 5), ("docs/transfer.md", 1), ("README.md", 1), ("python/README.md", 1)]
)
def test_the_blocks_of_a_page_run(page, fewest, workplace):
    code = blocks(page)
    assert len(code) >= fewest
    names = dict(workplace)
    for block in code:
        exec(compile(block, page, "exec"), names)
    if page == "docs/python.md":
        assert names["found"].mean < 0.1 and len(names["refined"].targets) == 2400
        assert names["colors"].shape == (2400, 3) and names["weights"].dtype == np.float32
