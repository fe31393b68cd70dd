"""Matching: the same bytes as the program, whatever the form of the meshes."""

import json
import pickle
import types
import warnings

import fmnet
import numpy as np
import pytest

from conftest import sphere

SHOT = dict(descriptor="shot", k=40, shot_radius=0.2, subdivide="off")


def test_a_map_of_files_has_the_bytes_of_the_program(demo, program, tmp_path):
    source, target = demo
    match = fmnet.match(source, target)
    program("match", source, target, "-o", tmp_path / "p.txt", "-o", tmp_path / "p.csv", "-o", tmp_path / "p.npy", "-o", tmp_path / "p.npz",
            "--save-functional-map", tmp_path / "c.npy")  # fmt: skip
    for extension in ["txt", "csv", "npy", "npz"]:
        match.save(tmp_path / f"m.{extension}")
        assert (tmp_path / f"m.{extension}").read_bytes() == (tmp_path / f"p.{extension}").read_bytes()
    np.testing.assert_array_equal(match.functional_map, np.load(tmp_path / "c.npy"))
    np.testing.assert_array_equal(match.targets, np.load(tmp_path / "p.npy"))


def test_vertices_that_repair_left_out_are_marked_and_an_npz_map_is_read_back(program, tmp_path):
    vertices, faces = sphere()
    crumb, crumb_faces = sphere(1)
    all_vertices = np.concatenate([vertices, 0.01 * crumb + vertices[7]])
    joined = np.concatenate([faces, crumb_faces + len(vertices)])
    with pytest.warns(fmnet.FmnetWarning, match="42 of 684 vertices.* follow"):
        match = fmnet.match((all_vertices, joined), (vertices, faces), **SHOT)
    np.testing.assert_array_equal(match.followers, np.arange(len(vertices), len(all_vertices)))
    assert match.followers.dtype == np.int32 and (match.targets >= 0).all()
    assert len(fmnet.match((vertices, faces), (vertices, faces), **SHOT).followers) == 0
    match.save(tmp_path / "map.npz")
    with np.load(tmp_path / "map.npz") as saved:
        np.testing.assert_array_equal(saved["followers"], match.followers)
        np.savez_compressed(tmp_path / "packed.npz", **saved)
    for name, (points, triangles) in {"a": (all_vertices, joined), "b": (vertices, faces)}.items():
        lines = ["v {} {} {}".format(*p) for p in points] + ["f {} {} {}".format(*t) for t in triangles + 1]
        (tmp_path / f"{name}.obj").write_text("\n".join(lines) + "\n")
    np.save(tmp_path / "values.npy", np.arange(len(vertices)))
    for stem in ["map", "packed"]:
        program("transfer", tmp_path / "a.obj", tmp_path / "b.obj", "--map", tmp_path / f"{stem}.npz",
                "--values", tmp_path / "values.npy", "-o", tmp_path / f"{stem}.npy")  # fmt: skip
    np.testing.assert_array_equal(np.load(tmp_path / "map.npy"), np.load(tmp_path / "packed.npy"))


@pytest.mark.parametrize(
    "options",
    [
        dict(descriptor="shot", k=30, shot_radius=0.1),
        dict(refine="zoomout", k=50),
        dict(fm="bidirectional", mask_weight=0.1, refine="none"),
        dict(decimate=1000, upscale="least-squares", effort="low"),
        dict(decimate=1000),
        dict(subdivide=3000),
        dict(adapt=2, backend="native"),
        dict(backend="tract"),
        dict(decimate="off", refine="icp"),
    ],
    ids=str,
)
def test_options_are_those_of_the_program(demo, program, tmp_path, options):
    source, target = demo
    words = [word for name, value in options.items() for word in ("--" + name.replace("_", "-"), value)]
    program("match", source, target, "-o", tmp_path / "p.csv", *words)
    fmnet.match(source, target, **options).save(tmp_path / "m.csv")
    assert (tmp_path / "m.csv").read_bytes() == (tmp_path / "p.csv").read_bytes()


def test_a_part_is_matched_as_by_the_program(demo, program, tmp_path):
    vertices, faces = fmnet_mesh(demo[0])
    keep = vertices[:, 1] < np.quantile(vertices[:, 1], 0.6)
    index = np.cumsum(keep) - 1
    part = vertices[keep], index[faces[keep[faces].all(axis=1)]]
    write_off(tmp_path / "part.off", *part)
    program("match", tmp_path / "part.off", demo[1], "--partial", "-k", 30, "-o", tmp_path / "p.txt")
    fmnet.match(tmp_path / "part.off", demo[1], partial=True, k=30).save(tmp_path / "m.txt")
    assert (tmp_path / "m.txt").read_bytes() == (tmp_path / "p.txt").read_bytes()


def fmnet_mesh(path):
    """The mesh of a file, as it is worked on without decimation and repair to do."""
    shape = fmnet.Matcher(descriptor="shot", k=10).describe(path)
    return np.array(shape.vertices), np.array(shape.faces).astype(int)


def write_off(path, vertices, faces):
    lines = [f"OFF\n{len(vertices)} {len(faces)} 0"]
    lines += [" ".join(repr(float(x)) for x in v) for v in vertices]
    lines += [f"3 {a} {b} {c}" for a, b, c in faces]
    path.write_text("\n".join(lines) + "\n")


def test_files_arrays_and_objects_are_the_same_mesh(mesh, tmp_path):
    vertices, faces = mesh
    other = sphere(seed=1)
    write_off(tmp_path / "a.off", *mesh)
    expected = fmnet.match(tmp_path / "a.off", other, **SHOT)
    for form in [
        (vertices, faces),
        [vertices, faces.astype(np.uint16)],
        (np.asfortranarray(vertices), faces[:, ::-1][:, ::-1]),
        types.SimpleNamespace(vertices=vertices, faces=faces.astype(np.int8 if len(vertices) < 128 else np.int32)),
    ]:
        found = fmnet.match(form, other, **SHOT)
        np.testing.assert_array_equal(found.targets, expected.targets)
        np.testing.assert_array_equal(found.confidence, expected.confidence)


def test_single_precision_and_a_permuted_copy(mesh):
    vertices, faces = mesh
    vertices = vertices.astype(np.float32)
    order = np.random.default_rng(0).permutation(len(vertices))
    place = np.argsort(order)
    match = fmnet.match((vertices, faces), (vertices[order], place[faces]), **SHOT)
    np.testing.assert_array_equal(match.targets, place)


def test_results_are_read_only_arrays_of_the_result(mesh):
    match = fmnet.match(mesh, mesh, **SHOT)
    n = len(mesh[0])
    assert (match.targets.dtype, match.targets.shape) == (np.int32, (n,))
    assert (match.confidence.dtype, match.confidence.shape) == (np.float32, (n,))
    assert (match.functional_map.dtype, match.functional_map.shape) == (np.float64, (40, 40))
    assert (match.n_source, match.n_target) == (n, n)
    targets = match.targets
    assert targets.base is not None and np.shares_memory(targets, match.targets)
    with pytest.raises(ValueError, match="read-only"):
        targets[0] = 1
    del match
    assert targets.sum() >= 0


def test_described_shapes_give_the_same_and_come_back_from_files_and_pickles(mesh, tmp_path):
    matcher = fmnet.Matcher(**SHOT)
    other = sphere(seed=1)
    source, target = matcher.describe(mesh, name="ball"), matcher.describe(other)
    expected = fmnet.match(mesh, other, **SHOT)
    assert (source.name, source.n_input) == ("ball", len(mesh[0]))
    matcher.save(source, tmp_path / "ball.fms")
    for again in [source, matcher.load(tmp_path / "ball.fms"), pickle.loads(pickle.dumps(source))]:
        found = matcher.match(again, target)
        np.testing.assert_array_equal(found.targets, expected.targets)
        np.testing.assert_array_equal(again.descriptors, source.descriptors)
    np.testing.assert_array_equal(source.faces[:, 0], mesh[1][:, 0])
    basis = source.eigenbasis(10)
    np.testing.assert_allclose(basis.eigenvectors.T @ (basis.mass[:, None] * basis.eigenvectors), np.eye(10), atol=1e-8)


def test_shapes_of_another_model_are_refused(mesh, tmp_path):
    matcher, other = fmnet.Matcher(**SHOT), fmnet.Matcher(descriptor="shot", k=40, shot_radius=0.3)
    shape = matcher.describe(mesh, name="ball")
    matcher.save(shape, tmp_path / "ball.fms")
    with pytest.raises(fmnet.Error, match="ball was described by another model"):
        other.match(shape, mesh)
    with pytest.raises(fmnet.Error, match="ball.fms: ball was described by another model"):
        other.load(tmp_path / "ball.fms")
    data = (tmp_path / "ball.fms").read_bytes()
    (tmp_path / "cut.fms").write_bytes(data[:-100])
    with pytest.raises(fmnet.Error, match="cut.fms, described shape: its checksum"):
        matcher.load(tmp_path / "cut.fms")
    with pytest.raises(fmnet.Error, match="whole_area"):
        matcher.match(shape, mesh, partial=True)


def test_quality_and_points_on_the_surface(demo, program, mesh, tmp_path):
    match = fmnet.match(*demo)
    said = json.loads(program("match", *demo, "-o", tmp_path / "p.txt", "--json"))["quality"]
    assert match.quality._asdict() == said
    assert not match.quality.doubtful and 0 < match.quality.expected_error < 10
    # The points are near the vertices that the vertex map names.
    target = fmnet.Matcher(descriptor="shot", k=10).describe(demo[1])
    faces, weights = match.barycentric
    assert (faces.dtype, faces.shape, weights.shape) == (np.int32, (2400,), (2400, 3))
    np.testing.assert_allclose(weights.sum(axis=1), 1)
    points = (weights[:, :, None] * target.vertices[target.faces[faces]]).sum(axis=1)
    apart = np.linalg.norm(points - target.vertices[match.targets], axis=1)
    edges = target.vertices[target.faces]
    assert apart.mean() < np.linalg.norm(edges[:, 0] - edges[:, 1], axis=1).mean()
    # An inside-out copy is a mirrored map.
    flipped = mesh[0] * [-1, 1, 1], mesh[1]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mirrored = fmnet.match(mesh, flipped, descriptor="shot", k=10, shot_radius=0.2)
    assert mirrored.quality.reversed > match.quality.reversed


def test_landmarks_are_kept_as_by_the_program(demo, program, tmp_path):
    (tmp_path / "landmarks.txt").write_text("3 3\n700 700\n")
    program("match", *demo, "--landmarks", tmp_path / "landmarks.txt", "-o", tmp_path / "p.csv")
    match = fmnet.match(*demo, landmarks=[[3, 3], [700, 700]])
    match.save(tmp_path / "m.csv")
    assert (tmp_path / "m.csv").read_bytes() == (tmp_path / "p.csv").read_bytes()
    assert list(match.targets[[3, 700]]) == [3, 700]
    for wrong, text in [([[3, -1]], "landmarks: there is no vertex -1"), ([3, 7], "landmarks: the shape is"), ([[3, 2400]], "2400")]:
        with pytest.raises(fmnet.Error, match=text):
            fmnet.match(*demo, landmarks=wrong)


def test_small_meshes_are_subdivided_inside(mesh):
    options = dict(descriptor="shot", k=40, shot_radius=0.2)
    shape = fmnet.Matcher(**options).describe(mesh)
    assert shape.n_input == 642 and len(shape.vertices) >= 2000
    np.testing.assert_array_equal(shape.input_vertices[:642], np.arange(642))
    assert len(fmnet.match(mesh, mesh, **options).targets) == 642


def test_the_cache_is_used(mesh, tmp_path):
    expected = fmnet.match(mesh, mesh, **SHOT).targets
    stages = []
    for _ in range(2):
        stages.clear()
        match = fmnet.match(mesh, mesh, cache=tmp_path / "cache", progress=lambda *event: stages.append(event[1]), **SHOT)
        np.testing.assert_array_equal(match.targets, expected)
    assert "shot" not in stages and "functional map" in stages
