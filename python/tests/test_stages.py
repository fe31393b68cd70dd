"""Single stages on plain arrays."""

import json

import fmnet
import numpy as np
import pytest

from conftest import sphere


def test_features_are_those_that_the_program_writes(demo, program, tmp_path):
    for options in [{}, dict(descriptor="shot", k=30, decimate=800)]:
        words = [word for name, value in options.items() for word in ("--" + name, value)]
        out = tmp_path / f"features{len(options)}"
        program("features", demo[0], "--out", out, *words)
        found = fmnet.features(demo[0], **options)
        written = {path.stem: np.load(path) for path in out.glob("*.npy")}
        written.setdefault("vertices", np.arange(len(written["mass"]), dtype=np.int32))
        assert set(found) == set(written)
        for name, array in written.items():
            assert found[name].dtype == array.dtype
            np.testing.assert_array_equal(found[name], array, err_msg=name)


def test_the_eigenbasis_solves_its_equation(mesh):
    basis = fmnet.eigenbasis(mesh, 20)
    assert basis.mass.sum() == pytest.approx(1)
    gram = basis.eigenvectors.T @ (basis.mass[:, None] * basis.eigenvectors)
    np.testing.assert_allclose(gram, np.eye(20), atol=1e-8)
    assert basis.eigenvalues[0] == pytest.approx(0, abs=1e-8) and (np.diff(basis.eigenvalues) > -1e-9).all()
    own = fmnet.eigenbasis(mesh, 20, unit_area=False)
    np.testing.assert_allclose(own.eigenvalues * own.mass.sum(), basis.eigenvalues, rtol=1e-9, atol=1e-9)
    round_one = fmnet.eigenbasis((mesh[0] / np.linalg.norm(mesh[0], axis=1, keepdims=True), mesh[1]), 9, unit_area=False)
    np.testing.assert_allclose(round_one.eigenvalues, [0, 2, 2, 2, 6, 6, 6, 6, 6], rtol=0.02, atol=1e-9)


def test_the_stages_one_after_another_find_the_permutation(mesh):
    vertices, faces = mesh
    order = np.random.default_rng(0).permutation(len(vertices))
    place = np.argsort(order)
    other = vertices[order], place[faces]
    bases = fmnet.eigenbasis(mesh, 80), fmnet.eigenbasis(other, 80)
    descriptors = fmnet.shot(mesh, radius=0.2), fmnet.shot(other, radius=0.2)
    assert descriptors[0].shape == (len(vertices), 352)
    first = [fmnet.Eigenbasis(b.eigenvalues[:40], b.eigenvectors[:, :40], b.mass) for b in bases]
    c = fmnet.functional_map(*first, *descriptors, fm="least-squares")
    assert c.shape == (40, 40)
    raw = fmnet.point_map(c, *bases)
    np.testing.assert_array_equal(raw.targets, place)
    refined = fmnet.zoomout(raw.targets, *bases, k_start=40, k_step=10, k_max=80)
    np.testing.assert_array_equal(refined.targets, place)
    assert refined.functional_map.shape == (80, 80)
    # A tuple of arrays will do, and single precision.
    plain = [tuple(array.astype(np.float32) for array in basis) for basis in bases]
    assert (fmnet.zoomout(raw, *plain, k_start=40, k_max=80).targets == place).mean() > 0.99


def test_bad_arrays_are_named(mesh):
    basis = fmnet.eigenbasis(mesh, 10)
    n = len(mesh[0])
    descriptors = np.zeros((n, 4), np.float32)
    with pytest.raises(fmnet.Error, match=r"target_descriptors: the shape is \[641, 4\], expected \[642, any\]"):
        fmnet.functional_map(basis, basis, descriptors, descriptors[1:])
    with pytest.raises(fmnet.Error, match="source_basis, mass: the shape"):
        fmnet.functional_map((basis[0], basis[1], basis[2][1:]), basis, descriptors, descriptors)
    with pytest.raises(fmnet.Error, match="source_basis: 2 parts"):
        fmnet.point_map(np.eye(10), basis[:2], basis)
    with pytest.raises(fmnet.Error, match="source_basis: 10 eigenpairs, but the functional map has 11"):
        fmnet.point_map(np.eye(11), basis, basis)
    with pytest.raises(fmnet.Error, match="source vertex 1 is matched to target vertex 642"):
        fmnet.zoomout(np.r_[0, n, np.zeros(n - 2, int)], basis, basis)
    with pytest.raises(fmnet.Error, match="k_start"):
        fmnet.zoomout(np.zeros(n, int), basis, basis, k_start=0)
    with pytest.raises(fmnet.Error, match="ask for 1 to"):
        fmnet.eigenbasis(mesh, 1000)
    with pytest.raises(fmnet.Error, match="bins"):
        fmnet.shot(mesh, bins=0)


def test_geodesic_distances():
    flat = np.stack(np.meshgrid(np.arange(6.0), np.arange(5.0), [0.0]), axis=-1).reshape(-1, 3)
    quads = np.array([[i, i + 1, i + 7, i + 6] for i in range(24) if i % 6 != 5])
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    expected = np.linalg.norm(flat[:, None] - flat[None], axis=2)
    distances = fmnet.geodesic_distances((flat, faces))
    assert distances.dtype == np.float32
    np.testing.assert_allclose(distances, expected, atol=1e-5)
    np.testing.assert_array_equal(fmnet.geodesic_distances((flat, faces), [3, 7]), distances[[3, 7]])
    np.testing.assert_array_equal(fmnet.geodesic_distances((flat, faces), 3), distances[3])
    for wrong in [30, -1]:
        with pytest.raises(fmnet.Error, match=f"sources: there is no vertex {wrong}; the mesh has 30"):
            fmnet.geodesic_distances((flat, faces), [0, wrong])


def test_an_evaluation_is_the_distance_to_the_truth(mesh):
    n = len(mesh[0])
    truth = np.arange(n)
    area = fmnet.eigenbasis(mesh, 1, unit_area=False).mass.sum()
    targets = truth.copy()
    targets[5] = 9
    targets[6] = -1
    found = fmnet.evaluate(targets, truth, mesh)
    assert found.errors[5] == pytest.approx(fmnet.geodesic_distances(mesh, 9)[5] / np.sqrt(area), rel=1e-5)
    assert np.isnan(found.errors[6]) and (np.delete(found.errors, [5, 6]) == 0).all()
    assert found.exact == pytest.approx((n - 2) / n) and found.coverage == pytest.approx((n - 1) / n)
    assert found.worst == pytest.approx(found.errors[5]) and found.count == n and not found.mirrored
    mirrored = fmnet.evaluate(truth[::-1], truth, mesh, symmetric_truth=truth[::-1])
    assert mirrored.mirrored and mirrored.mean == 0
    some = truth.copy()
    some[10:] = -1
    assert fmnet.evaluate(targets, some, mesh).count == 10
    with pytest.raises(fmnet.Error, match="truth: no vertex has a match"):
        fmnet.evaluate(targets, np.full(n, -1), mesh)
    with pytest.raises(fmnet.Error, match="truth: the shape"):
        fmnet.evaluate(targets, truth[1:], mesh)


def test_the_evaluation_of_the_program(demo, program, tmp_path):
    match = fmnet.match(*demo, descriptor="shot", k=30)
    truth = np.arange(match.n_target)  # Whatever it says, both measure the same.
    found = fmnet.evaluate(match, truth, demo[1])
    assert 0 < found.mean < 1 and 0 <= found.exact <= 1
    match.save(tmp_path / "map.txt")
    program("evaluate", tmp_path / "map.txt", "--source", demo[0], "--target", demo[1], "--ground-truth", "identity",
            "-o", tmp_path / "curve.csv")  # fmt: skip
    percent = np.genfromtxt(tmp_path / "curve.csv", delimiter=",", names=True)
    names = percent.dtype.names
    shares = [100 * np.mean(found.errors <= limit) for limit in percent[names[0]]]
    np.testing.assert_allclose(percent[names[1]], shares, atol=0.2)
    match.save(tmp_path / "map.csv")
    said = program("evaluate", tmp_path / "map.csv", "--source", demo[0], "--target", demo[1], "--ground-truth", "identity", "--json")
    np.testing.assert_allclose(found.mean_on_surface, json.loads(said)["maps"][0]["on_surface"]["mean"], rtol=1e-3)
    assert fmnet.evaluate(match.targets, truth, demo[1]).mean_on_surface is None


def test_values_follow_the_map(mesh):
    vertices, faces = mesh
    order = np.random.default_rng(0).permutation(len(vertices))
    place = np.argsort(order)
    other = vertices[order], place[faces]
    field = vertices[order].astype(np.float32)
    moved = fmnet.transfer(field, place, mesh, other)
    assert moved.dtype == np.float32
    np.testing.assert_allclose(moved, vertices, atol=1e-6)
    back = fmnet.transfer(vertices[:, 0], place, mesh, other, to="target")
    np.testing.assert_allclose(back, vertices[order, 0])
    labels = np.arange(len(vertices), dtype=np.uint16)
    np.testing.assert_array_equal(fmnet.transfer(labels, place, mesh, other), place)
    assert fmnet.transfer(labels > 7, place, mesh, other).dtype == bool
    np.testing.assert_array_equal(fmnet.transfer_landmarks([3, 5], place, mesh, other), order[[3, 5]])
    np.testing.assert_array_equal(fmnet.transfer_landmarks([3, 5], place, mesh, other, to="target"), place[[3, 5]])


def test_vertices_without_a_match_are_marked(mesh):
    n = len(mesh[0])
    targets = np.arange(n)
    targets[4] = -1
    assert np.isnan(fmnet.transfer(np.ones(n), targets, mesh, mesh)[4])
    assert fmnet.transfer(np.ones(n, int), targets, mesh, mesh)[4] == -1
    with pytest.warns(fmnet.FmnetWarning, match="1 vertices without a match have 0"):
        assert fmnet.transfer(np.ones(n, np.uint8), targets, mesh, mesh)[4] == 0
    with pytest.raises(fmnet.Error, match="landmarks: there is no vertex 642; the giving mesh has 642"):
        fmnet.transfer_landmarks([n], targets, mesh, mesh)
    with pytest.raises(fmnet.Error, match="to is"):
        fmnet.transfer(np.ones(n), targets, mesh, mesh, to="both")


def test_texture_coordinates_keep_their_seams():
    # A cylinder whose texture begins and ends at one line of vertices.
    around, rows = 12, 5
    angle = np.arange(around) * 2 * np.pi / around
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    vertices = np.concatenate([np.column_stack([ring, np.full(around, float(r))]) for r in range(rows)])
    cell = np.array([(r, c) for r in range(rows - 1) for c in range(around)])
    at = lambda r, c: r * around + c % around  # noqa: E731
    a, b, c, d = [at(cell[:, 0] + i, cell[:, 1] + j) for i, j in [(0, 0), (0, 1), (1, 1), (1, 0)]]
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    u = [(cell[:, 1] + j) / around for j in (0, 1, 1, 0)]
    v = [(cell[:, 0] + i) / rows for i in (0, 0, 1, 1)]
    corner = lambda i: np.stack([u[i], v[i]], axis=1)  # noqa: E731
    uvs = np.concatenate([np.stack([corner(i) for i in t], axis=1) for t in [(0, 1, 2), (0, 2, 3)]])
    moved = fmnet.transfer_uvs(uvs, np.arange(len(vertices)), (vertices, faces), (vertices, faces))
    assert moved.dtype == np.float32 and moved.shape == uvs.shape
    np.testing.assert_allclose(moved, uvs, atol=1e-6)
    assert (np.ptp(moved[:, :, 0], axis=1) < 0.2).all(), "a triangle spans the seam"


def test_pairs_and_keys_are_those_of_batch(demo, program, tmp_path):
    (tmp_path / "pairs.txt").write_text(f"{demo[0]} {demo[1]}\n# a comment\n{demo[1]}\t{demo[0]}\n")
    options = dict(descriptor="shot", k=20)
    program("batch", tmp_path / "pairs.txt", "--out", tmp_path / "maps", "--descriptor", "shot", "-k", 20)
    matcher = fmnet.Matcher(**options)
    pairs = fmnet.read_pairs(tmp_path / "pairs.txt", tmp_path / "again")
    assert len(pairs) == 2
    (tmp_path / "again").mkdir()
    for source, target, out in pairs:
        key = matcher.map_key(fmnet.mesh_hash(source), fmnet.mesh_hash(target))
        matcher.match(source, target).save(out, key=key)
        for name in [out.name, out.name + ".key"]:
            assert out.with_name(name).read_bytes() == (tmp_path / "maps" / name).read_bytes()
    with pytest.raises(fmnet.Error, match="is no hash of a mesh"):
        matcher.map_key("0", "1")
    (tmp_path / "bad.txt").write_text("one\n")
    with pytest.raises(fmnet.Error, match="bad.txt, line 1: expected two mesh files"):
        fmnet.read_pairs(tmp_path / "bad.txt", tmp_path)


def test_a_large_mesh_is_decimated_and_upscaled():
    large = sphere(4)
    match = fmnet.match(large, large, descriptor="shot", k=30, shot_radius=0.2, decimate=700)
    assert len(match.targets) == len(large[0])
    assert fmnet.evaluate(match, np.arange(len(large[0])), large).mean < 0.05
