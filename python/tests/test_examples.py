"""The examples run as a user runs them; those whose packages are not here are skipped by name."""

import importlib.util
import shutil
import subprocess
import sys

import fmnet
import numpy as np
import pytest

from conftest import ROOT

EXAMPLES = ROOT / "examples" / "python"


def run(example, *arguments):
    script = [sys.executable, EXAMPLES / example, *arguments]
    done = subprocess.run([str(word) for word in script], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def needs(*packages):
    missing = [name for name in packages if importlib.util.find_spec(name) is None]
    return pytest.mark.skipif(bool(missing), reason=f"not installed: {', '.join(missing)}")


@needs("matplotlib", "tqdm")
def test_match_and_plot(demo, tmp_path):
    import matplotlib.image

    assert "2400 of 2400 vertices matched" in run("match_and_plot.py", *demo, tmp_path / "pair.png")
    picture = matplotlib.image.imread(tmp_path / "pair.png")
    left, right = np.array_split(picture[..., :3], 2, axis=1)
    for half in (left, right):
        drawn = half[np.ptp(half, axis=2) > 0.2]
        assert len(drawn) > 0.02 * half.shape[0] * half.shape[1], "no coloured body"


@needs("trimesh", "PIL")
def test_transfer_texture(demo, tmp_path):
    import trimesh

    run("transfer_texture.py", *demo, tmp_path / "textured.glb")
    textured = trimesh.load(tmp_path / "textured.glb", process=False, force="mesh")
    giver = trimesh.load(demo[1], process=False)
    assert len(textured.faces) == len(trimesh.load(demo[0], process=False).faces)
    assert textured.visual.material.baseColorTexture.size == (512, 512)
    # The first vertices correspond by index: each has about the coordinates of its own vertex on the giver.
    low, high = giver.bounds
    expected = ((giver.vertices - low) / (high - low))[:, :2]
    receiver = trimesh.load(demo[0], process=False)
    vertices, found = receiver.faces.ravel(), np.asarray(textured.visual.uv)[textured.faces].reshape(-1, 2)
    known = vertices < 1000
    assert np.median(np.linalg.norm(found[known] - expected[vertices[known]], axis=1)) < 0.05


@needs("tqdm")
def test_landmarks(demo, tmp_path):
    (tmp_path / "specimens").mkdir()
    shutil.copy(demo[1], tmp_path / "specimens" / "b.ply")
    (tmp_path / "specimens" / "readme.txt").write_text("no mesh")
    (tmp_path / "landmarks.txt").write_text("3\n1700\n")
    out = tmp_path / "landmarks.csv"
    run("landmarks.py", demo[0], tmp_path / "landmarks.txt", tmp_path / "specimens", out)
    match = fmnet.match(*demo)
    rows = [line.split(",") for line in out.read_text().split()]
    assert rows[0] == ["mesh", "landmark", "vertex", "confidence"]
    assert [row[:3] for row in rows[1:]] == [["b.ply", "0", str(match.targets[3])], ["b.ply", "1", str(match.targets[1700])]]


@pytest.mark.filterwarnings("default")
def test_compare_pyfm(demo, tmp_path):
    (tmp_path / "registrations").mkdir()
    shape = fmnet.Matcher(descriptor="shot", k=10).describe(demo[0])
    height = shape.vertices[:, 1]
    for name, bend in [("a", 0.0), ("b", 0.3)]:
        vertices = shape.vertices + np.column_stack([bend * height**2, 0 * height, 0 * height])
        lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
        lines += [f"f {a} {b} {c}" for a, b, c in (shape.faces.astype(int) + 1).tolist()]
        (tmp_path / "registrations" / f"{name}.obj").write_text("\n".join(lines) + "\n")
    table = run("compare_pyfm.py", tmp_path / "registrations", "--pairs", 1)
    words = [line.split() for line in table.splitlines()]
    rows = {name: [float(word.rstrip("%")) for word in rest] for name, *rest in words if name in ("fmnet", "pyFM") and len(rest) == 4}
    assert rows["fmnet"][0] < 10
    if importlib.util.find_spec("pyFM") is None:
        assert "pyFM is not installed" in table
    else:
        assert 0 < rows["pyFM"][0] < 100
