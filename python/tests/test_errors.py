"""What is wrong is said: the argument, the element, the remedy."""

import warnings

import fmnet
import numpy as np
import pytest

SHOT = dict(descriptor="shot", k=10, subdivide="off")


def changed(array, at, value):
    array = array.copy()
    array[at] = value
    return array


@pytest.mark.parametrize(
    "form, text",
    [
        (lambda v, f: (v, changed(f, (3, 1), 5000)), "source: face 3 refers to vertex 5000, but there are only 642"),
        (lambda v, f: (v, changed(f, (3, 1), -1)), "source: face 3 refers to vertex -1"),
        (lambda v, f: (changed(v, (7, 0), np.nan), f), "source: vertex 7 has a coordinate that is not finite"),
        (lambda v, f: (v[:, :2], f), r"source, vertices: the shape is \[642, 2\], expected \[any, 3\]"),
        (lambda v, f: (v, f.ravel()), r"source, faces: the shape is \[3840\], expected \[any, 3\]"),
        (lambda v, f: (v.astype(np.float16), f), "source, vertices: the type is float16, expected float32 or float64"),
        (lambda v, f: (v.astype(int), f), "source, vertices: the type is int64"),
        (lambda v, f: (v, f.astype(float)), "source, faces: the type is float64, expected integers"),
        (lambda v, f: (v, f, f), "source: 3 parts, expected two"),
        (lambda v, f: 7, "source: int is no mesh; pass a path"),
        (lambda v, f: (v, f[:0]), "source: .*face"),
    ],
)
def test_bad_meshes(mesh, form, text):
    with pytest.raises(fmnet.Error, match=text) as error:
        fmnet.match(form(*mesh), mesh, **SHOT)
    assert isinstance(error.value, ValueError)


@pytest.mark.parametrize(
    "options, text",
    [
        (dict(k=0), "k is 0, expected 1 to 500"),
        (dict(refine="best"), "refine: unknown variant `best`, expected one of `none`"),
        (dict(fm="best"), "fm: unknown variant `best`"),
        (dict(mask_weight=-1.0), "mask_weight is -1, expected 0 or more"),
        (dict(decimate=3), "decimate is 3, expected a number of vertices"),
        (dict(decimate="no"), "decimate is no"),
        (dict(subdivide=10), "subdivide is 10, expected a number of vertices"),
        (dict(shot_radius=2.0), "shot_radius is 2"),
        (dict(adapt=101), "adapt is 101, expected 0 to 100"),
        (dict(backend="gpu"), "backend: unknown variant `gpu`"),
        (dict(descriptor="sift"), "descriptor: unknown variant `sift`"),
    ],
)
def test_bad_options(options, text):
    with pytest.raises(fmnet.Error, match=text):
        fmnet.Matcher(**options)


def test_files(mesh, tmp_path):
    with pytest.raises(FileNotFoundError) as error:
        fmnet.match(tmp_path / "none.off", mesh, **SHOT)
    assert error.value.filename == str(tmp_path / "none.off")
    (tmp_path / "bad.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n")
    with pytest.raises(fmnet.Error, match="bad.off, line"):
        fmnet.match(tmp_path / "bad.off", mesh, **SHOT)
    with pytest.raises(FileNotFoundError, match="none.onnx"):
        fmnet.Matcher(tmp_path / "none.onnx")
    (tmp_path / "bad.onnx").write_bytes(b"nothing")
    with pytest.raises(fmnet.Error, match="bad.onnx"):
        fmnet.Matcher(tmp_path / "bad.onnx")
    match = fmnet.match(mesh, mesh, **SHOT)
    with pytest.raises(fmnet.Error, match="map.xyz: this format is not known"):
        match.save(tmp_path / "map.xyz")
    with pytest.raises(FileNotFoundError):
        match.save(tmp_path / "none" / "map.txt")


def test_warnings_are_warnings_of_python(mesh):
    matcher = fmnet.Matcher(shot_radius=0.01, **SHOT)
    with pytest.warns(fmnet.FmnetWarning, match="mesh: 642 of 642 vertices have too few neighbours") as caught:
        matcher.describe(mesh)
    assert caught[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(fmnet.FmnetWarning, match="too few neighbours"):
            matcher.describe(mesh)


def test_messages_name_arguments(mesh):
    with pytest.warns(fmnet.FmnetWarning, match=r"\(subdivide=N\)$"):
        fmnet.Matcher(shot_radius=0.01, **SHOT).describe(mesh)
    part = fmnet.Matcher(descriptor="shot", k=10, subdivide="off", refine="icp")
    with pytest.raises(fmnet.Error, match='with refine="zoomout"'):
        part.match(mesh, mesh, partial=True)


def test_warnings_of_a_file(mesh, tmp_path):
    path = tmp_path / "a.ply"
    path.write_text("OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n")
    with pytest.warns(fmnet.FmnetWarning, match="a.ply: the name is that of a PLY file"):
        fmnet.eigenbasis(path, 2)
