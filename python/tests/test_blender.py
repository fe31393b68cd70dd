"""The Blender add-on, in Blender as a Python module without a window; skipped where that is not installed."""

import os
import sys

import numpy as np
import pytest

from conftest import ROOT, sphere

bpy = pytest.importorskip("bpy", reason="no Blender here: pip install bpy==4.2.* with Python 3.11")
import addon_utils  # noqa: E402

sys.path.insert(0, str(ROOT / "examples" / "blender"))
pytestmark = pytest.mark.filterwarnings("default")


def settings():
    return bpy.context.preferences.addons["fmnet_transfer"].preferences


@pytest.fixture
def operator(program):
    """The add-on, enabled in an empty scene, with the program named in its preferences."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert addon_utils.enable("fmnet_transfer", default_set=True) is not None
    settings().program = os.environ.get("FMNET_INFER") or str(ROOT / "target" / "release" / "fmnet-infer")
    yield bpy.ops.object.fmnet_transfer
    addon_utils.disable("fmnet_transfer", default_set=True)


def add(name, vertices, faces):
    data = bpy.data.meshes.new(name)
    data.from_pydata(np.asarray(vertices).tolist(), [], [list(map(int, f)) for f in faces])
    new = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(new)
    return new


def select(giver, receiver):
    for each in bpy.data.objects:
        each.select_set(each in (giver, receiver))
    bpy.context.view_layer.objects.active = receiver


def pair():
    """A bumpy ball, and a larger copy of it in another order, half as large in the scene and turned."""
    vertices, faces = sphere(3)
    order = np.random.default_rng(0).permutation(len(vertices))
    giver = add("giver", vertices, faces)
    receiver = add("receiver", vertices[order] * 2, np.argsort(order)[faces][::-1])
    receiver.scale, receiver.rotation_euler, receiver.location = (0.5,) * 3, (np.pi / 2, 0, 0), (3, 0, 0)
    select(giver, receiver)
    return giver, receiver, vertices, order


def copies(subdivisions=3):
    """Two bumpy balls alike."""
    vertices, faces = sphere(subdivisions)
    giver, receiver = add("giver", vertices, faces), add("receiver", vertices, faces)
    select(giver, receiver)
    return giver, receiver, vertices, faces


def read(collection, name, width):
    values = np.empty(len(collection) * width, np.float32)
    collection.foreach_get(name, values)
    return values.reshape(-1, width)


def write(collection, name, values):
    collection.foreach_set(name, np.ascontiguousarray(values, np.float32).ravel())


def corners_of(data):
    """The vertex of every corner."""
    return np.array([loop.vertex_index for loop in data.loops])


def tint_of(vertices):
    return np.column_stack([vertices * 0.3 + 0.5, np.ones(len(vertices))])


def add_group(giver, name, weights):
    group = giver.vertex_groups.new(name=name)
    for v in np.flatnonzero(weights > 0):
        group.add([int(v)], float(weights[v]), "REPLACE")


def weights_in(receiver, name):
    index = receiver.vertex_groups[name].index
    found = np.zeros(len(receiver.data.vertices))
    for vertex in receiver.data.vertices:
        for group in vertex.groups:
            if group.group == index:
                found[vertex.index] = group.weight
    return found


def add_key(giver, name, places):
    if giver.data.shape_keys is None:
        giver.shape_key_add(name="Basis")
    key = giver.shape_key_add(name=name)
    write(key.data, "co", places)
    return key


def dress(giver, vertices):
    """Something of everything."""
    for name, axis in [("left", 0), ("up", 2)]:
        add_group(giver, name, np.clip(vertices[:, axis], 0, 1))
    write(giver.data.color_attributes.new("tint", "FLOAT_COLOR", "POINT").data, "color", tint_of(vertices))
    uvs = vertices[corners_of(giver.data)][:, :2] * 0.2 + 0.5
    write(giver.data.uv_layers.new(name="map").uv, "vector", uvs)
    add_key(giver, "lift", vertices + [0, 0, 0.5]).value = 0.25


def is_bare(each):
    data = each.data
    return not each.vertex_groups and not data.color_attributes and not data.uv_layers and data.shape_keys is None


def test_everything_is_carried_over(operator):
    giver, receiver, vertices, order = pair()
    dress(giver, vertices)
    assert operator() == {"FINISHED"}
    there = vertices[order]
    assert [group.name for group in receiver.vertex_groups] == ["left", "up"]
    for name, axis in [("left", 0), ("up", 2)]:
        assert np.abs(weights_in(receiver, name) - np.clip(there[:, axis], 0, 1)).mean() < 0.01
    colors = receiver.data.color_attributes["tint"]
    assert colors.domain == "POINT"
    assert np.abs(read(colors.data, "color", 4) - tint_of(there)).mean() < 0.01
    uvs = read(receiver.data.uv_layers["map"].uv, "vector", 2)
    assert np.abs(uvs - (there[corners_of(receiver.data)][:, :2] * 0.2 + 0.5)).mean() < 0.01
    key = receiver.data.shape_keys.key_blocks["lift"]
    assert key.value == 0.25
    # Up in the scene, which is along the turned receiver's y, in its unit.
    assert np.allclose(read(key.data, "co", 3) - there * 2, [0, 1, 0], atol=0.01)


def test_once_more_over_what_is_there(operator):
    giver, receiver, vertices, _ = pair()
    dress(giver, vertices)
    for _ in range(2):
        assert operator() == {"FINISHED"}
    assert len(receiver.vertex_groups) == 2 and len(receiver.data.color_attributes) == 1
    assert len(receiver.data.uv_layers) == 1 and len(receiver.data.shape_keys.key_blocks) == 2


def test_the_values_are_those_at_the_points_of_the_map(operator, program, demo, tmp_path):
    for path in demo:
        bpy.ops.wm.ply_import(filepath=str(path))
    receiver, giver = (bpy.data.objects[path.stem] for path in demo)
    assert len(receiver.data.vertices) == 2400
    places = read(giver.data.vertices, "co", 3)
    write(giver.data.color_attributes.new("place", "FLOAT_COLOR", "POINT").data, "color", np.pad(places, ((0, 0), (0, 1))))
    select(giver, receiver)
    assert operator() == {"FINISHED"}
    program("match", *demo, "-o", tmp_path / "map.npz")
    found = np.load(tmp_path / "map.npz")
    faces = np.array([polygon.vertices for polygon in giver.data.polygons])
    expected = (places[faces[found["faces"]]] * found["weights"][:, :, None]).sum(axis=1)
    carried = read(receiver.data.color_attributes["place"].data, "color", 4)[:, :3]
    assert np.quantile(np.linalg.norm(carried - expected, axis=1), 0.95) < 0.01 * np.linalg.norm(np.ptp(places, axis=0))


def test_only_what_is_ticked(operator):
    giver, receiver, vertices, _ = pair()
    dress(giver, vertices)
    assert operator(weights=False, uvs=False, shape_keys=False) == {"FINISHED"}
    assert not receiver.vertex_groups and not receiver.data.uv_layers and receiver.data.shape_keys is None
    assert len(receiver.data.color_attributes) == 1


def test_undo(operator):
    giver, receiver, vertices, _ = pair()
    dress(giver, vertices)
    bpy.ops.ed.undo_push()
    assert operator("EXEC_DEFAULT", True) == {"FINISHED"}
    assert not is_bare(bpy.data.objects["receiver"])
    bpy.ops.ed.undo()
    assert is_bare(bpy.data.objects["receiver"]) and not is_bare(bpy.data.objects["giver"])


@pytest.mark.parametrize("domain", ["POINT", "CORNER"])
@pytest.mark.parametrize("kind", ["FLOAT_COLOR", "BYTE_COLOR"])
def test_colours_of_every_kind(operator, capfd, domain, kind):
    giver, receiver, vertices, _ = copies()
    tint, corners = tint_of(vertices), corners_of(giver.data)
    write(giver.data.color_attributes.new("tint", kind, domain).data, "color", tint if domain == "POINT" else tint[corners])
    # What the receiver has stays of its kind.
    receiver.data.color_attributes.new("tint", "BYTE_COLOR", "CORNER")
    assert operator() == {"FINISHED"}
    assert np.abs(read(receiver.data.color_attributes["tint"].data, "color", 4) - tint[corners]).mean() < 0.02
    assert "hard borders" not in capfd.readouterr().out


def test_colours_that_are_cut_off_are_reported(operator, capfd):
    giver, receiver, vertices, _ = copies()
    write(giver.data.color_attributes.new("glow", "FLOAT_COLOR", "POINT").data, "color", 5 * tint_of(vertices))
    assert operator() == {"FINISHED"}
    assert "cut off" not in capfd.readouterr().out
    assert read(receiver.data.color_attributes["glow"].data, "color", 4).max() > 4
    receiver.data.color_attributes.remove(receiver.data.color_attributes["glow"])
    receiver.data.color_attributes.new("glow", "BYTE_COLOR", "POINT")
    assert operator() == {"FINISHED"}
    assert "colours of glow beyond 0 to 1 were cut off" in capfd.readouterr().out


def test_hard_borders_of_colours_are_reported(operator, capfd):
    giver, *_ = copies()
    colors = np.repeat(np.random.default_rng(0).random((len(giver.data.polygons), 4)), 3, axis=0)
    write(giver.data.color_attributes.new("patches", "BYTE_COLOR", "CORNER").data, "color", colors)
    assert operator() == {"FINISHED"}
    assert "hard borders in colour attribute patches" in capfd.readouterr().out


def in_edit_mode(each, action):
    """Does something to all of an object's mesh as a user does."""
    select(each, each)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    action()
    bpy.ops.object.mode_set(mode="OBJECT")


def test_no_polygon_goes_across_a_seam(operator):
    giver, receiver, vertices, _ = copies()
    angle = (np.arctan2(vertices[:, 1], vertices[:, 0]) / (2 * np.pi))[corners_of(giver.data)].reshape(-1, 3)
    angle[(np.ptp(angle, axis=1, keepdims=True) > 0.5) & (angle < 0)] += 1
    uvs = np.column_stack([angle.ravel(), vertices[corners_of(giver.data)][:, 2] * 0.2])
    write(giver.data.uv_layers.new(name="around").uv, "vector", uvs)
    in_edit_mode(receiver, lambda: bpy.ops.mesh.tris_convert_to_quads(face_threshold=3.2, shape_threshold=3.2))
    assert any(len(polygon.vertices) == 4 for polygon in receiver.data.polygons)
    select(giver, receiver)
    assert operator() == {"FINISHED"}
    found = read(receiver.data.uv_layers["around"].uv, "vector", 2)[:, 0]
    wide = [polygon for polygon in receiver.data.polygons if np.ptp(found[list(polygon.loop_indices)]) > 0.4]
    # Around the poles all angles meet.
    assert all(np.linalg.norm(polygon.center[:2]) < 0.3 for polygon in wide)


def test_polygons_and_loose_vertices(operator, capfd):
    giver, receiver, vertices, _ = copies()
    dress(giver, vertices)
    in_edit_mode(receiver, lambda: bpy.ops.mesh.dissolve_limited(angle_limit=0.03))
    assert max(len(polygon.vertices) for polygon in receiver.data.polygons) > 4
    n = len(receiver.data.vertices)
    receiver.data.vertices.add(2)
    for loose in (n, n + 1):
        receiver.data.vertices[loose].co = (100, 0, 0)
    select(giver, receiver)
    assert operator() == {"FINISHED"}
    places = read(receiver.data.vertices, "co", 3)[:n]
    assert np.abs(read(receiver.data.color_attributes["tint"].data, "color", 4)[:n] - tint_of(places)).mean() < 0.02
    uvs = read(receiver.data.uv_layers["map"].uv, "vector", 2)
    assert np.abs(uvs - (places[corners_of(receiver.data)][:, :2] * 0.2 + 0.5)).mean() < 0.02
    # As large as without the loose ones.
    moves = read(receiver.data.shape_keys.key_blocks["lift"].data, "co", 3)[:n] - places
    assert np.abs(moves - [0, 0, 0.5]).max() < 0.02
    assert "2 vertices of receiver have no match" in capfd.readouterr().out


def test_a_mirrored_receiver_gets_left_on_its_left(operator):
    giver, receiver, vertices, faces = copies()
    # Open, so that only its faces tell its outside.
    faces = faces[(vertices[faces][:, :, 2] < 0.6).all(axis=1)]
    for each, places, triangles in [(giver, vertices, faces), (receiver, vertices * [-1, 1, 1], faces[:, ::-1])]:
        each.data.clear_geometry()
        each.data.from_pydata(places.tolist(), [], triangles.tolist())
    receiver.scale = (-1, 1, 1)
    dress(giver, vertices)
    assert operator() == {"FINISHED"}
    there = np.unique(faces)
    assert np.abs(weights_in(receiver, "left") - np.clip(vertices[:, 0], 0, 1))[there].mean() < 0.01


def test_shape_keys_keep_what_they_do(operator):
    giver, receiver, vertices, _ = copies()
    add_group(giver, "mask", np.ones(len(vertices)))
    first, second = add_key(giver, "first", vertices + [1, 0, 0]), add_key(giver, "second", vertices + [1, 1, 0])
    second.relative_key, second.vertex_group, second.mute = first, "mask", True
    first.slider_max, first.slider_min, first.value = 3, 2, 2.5
    assert operator() == {"FINISHED"}
    keys = receiver.data.shape_keys.key_blocks
    assert np.allclose(read(keys["second"].data, "co", 3) - vertices, [0, 1, 0], atol=1e-3)
    assert keys["second"].vertex_group == "mask" and keys["second"].mute and keys["second"].relative_key == keys["Basis"]
    assert (keys["first"].slider_min, keys["first"].slider_max, keys["first"].value) == (2, 3, 2.5)


def test_the_receivers_mesh_at_rest_stays(operator, capfd):
    giver, receiver, vertices, _ = copies()
    add_key(giver, "smile", vertices + [1, 0, 0])
    receiver.shape_key_add(name="smile")
    assert operator() == {"FINISHED"}
    keys = receiver.data.shape_keys
    assert keys.reference_key.name == "smile" and np.allclose(read(keys.reference_key.data, "co", 3), vertices)
    assert "shape key smile is called smile.001 on receiver" in capfd.readouterr().out


def test_shape_keys_of_a_part_are_as_large_as_on_the_whole(operator):
    giver, _, vertices, faces = copies()
    add_key(giver, "lift", vertices + [0, 0, 0.5])
    part = add("part", vertices, faces[(vertices[faces][:, :, 0] > -0.5).all(axis=1)])
    select(giver, part)
    assert operator(partial=True) == {"FINISHED"}
    moves = read(part.data.shape_keys.key_blocks["lift"].data, "co", 3) - vertices
    assert np.allclose(moves[vertices[:, 0] > 0], [0, 0, 0.5], atol=1e-3)


def test_names_that_are_taken_are_reported(operator, capfd):
    giver, receiver, vertices, _ = copies()
    dress(giver, vertices)
    receiver.data.attributes.new("map", "FLOAT", "POINT")
    add_group(receiver, "tint", np.ones(len(vertices)))
    add_group(receiver, "up", np.ones(len(vertices)))
    receiver.vertex_groups["up"].lock_weight = True
    assert operator() == {"FINISHED"}
    out = capfd.readouterr().out
    assert "UV map map is called map.001 on receiver" in out
    assert "colour attribute tint" in out
    assert "vertex group up was not carried: it is locked" in out and weights_in(receiver, "up").min() == 1


def test_too_many_uv_maps_are_reported(operator, capfd):
    giver, receiver, vertices, _ = copies()
    dress(giver, vertices)
    for number in range(8):
        receiver.data.uv_layers.new(name=f"own {number}")
    assert operator() == {"FINISHED"}
    assert "UV map map was not carried" in capfd.readouterr().out


def test_modifiers_that_change_what_there_is_are_reported(operator, capfd):
    giver, receiver, vertices, _ = copies()
    dress(giver, vertices)
    giver.modifiers.new("Subdivision", "SUBSURF")
    giver.modifiers.new("Armature", "ARMATURE")
    assert operator() == {"FINISHED"}
    assert "Warning" not in capfd.readouterr().out
    giver.modifiers.new("Mirror", "MIRROR")
    assert operator() == {"FINISHED"}
    assert "giver was matched without its modifiers: if the map is bad, apply first Mirror" in capfd.readouterr().out


def test_what_other_objects_share_is_reported(operator, capfd):
    giver, receiver, vertices, _ = copies()
    dress(giver, vertices)
    add("twin", vertices, []).data = receiver.data
    assert operator() == {"FINISHED"}
    assert "other objects have the mesh of receiver too" in capfd.readouterr().out


def test_nothing_to_carry_is_reported(operator, capfd):
    copies()
    assert operator() == {"FINISHED"}
    assert "nothing was carried: giver has nothing of what is ticked" in capfd.readouterr().out


def test_wrong_selections_say_what_to_select(operator):
    giver, receiver, *_ = copies()
    empty = bpy.data.objects.new("empty", None)
    bpy.context.collection.objects.link(empty)
    for chosen in [(receiver, receiver), (empty, receiver), (giver, empty)]:
        select(*chosen)
        with pytest.raises(RuntimeError, match="Select two meshes"):
            operator()
    select(giver, receiver)
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match="Object Mode"):
        operator()
    bpy.ops.object.mode_set(mode="OBJECT")


def test_wrong_meshes_say_what_is_wrong(operator):
    giver, receiver, vertices, _ = copies()
    dress(giver, vertices)
    flat, points = add("flat", np.zeros((3, 3)), [[0, 1, 2]]), add("points", vertices, [])
    squashed, twin = add("squashed", vertices, [[0, 1, 2]]), add("twin", vertices, [])
    squashed.scale, twin.data = (1, 0, 1), giver.data
    wrong = {flat: "flat: none of the 1 faces", points: "points has no faces", squashed: "scale of 0", twin: "the same mesh"}
    for each, message in wrong.items():
        select(giver, each)
        with pytest.raises(RuntimeError, match=message):
            operator()
        assert each is twin or is_bare(each)


def use_script(path, text):
    """Instead of the program."""
    path.write_text(text)
    path.chmod(0o755)
    settings().program = str(path)


def test_options_reach_the_program(operator, tmp_path):
    copies()
    use_script(tmp_path / "echo", "#!/bin/sh\necho \"error: $*\" >&2\nexit 2\n")
    # Named as in Blender.
    with pytest.raises(RuntimeError, match="--quiet match receiver giver --partial Thorough -o map.npz"):
        operator(partial=True, thorough=True)


def test_linked_objects_say_what_to_do(operator, tmp_path):
    giver, receiver, vertices, _ = copies()
    dress(giver, vertices)
    bpy.data.libraries.write(str(tmp_path / "library.blend"), {receiver})
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, linked):
        linked.objects = ["receiver"]
    bpy.context.collection.objects.link(linked.objects[0])
    select(giver, linked.objects[0])
    with pytest.raises(RuntimeError, match="receiver is linked from another file: Object > Relations > Make Local"):
        operator()


def test_wrong_programs_say_what_to_do(operator, tmp_path, monkeypatch):
    giver, receiver, vertices, _ = copies()
    dress(giver, vertices)
    scripts = {
        "failing": ("#!/bin/sh\necho 'error: giver.obj: is torn' >&2\nexit 2\n", "giver: is torn"),
        "crashing": ("#!/bin/sh\necho 'out of luck' >&2\nexit 9\n", "status 9: out of luck"),
        "other": ("#!/bin/sh\n", "wrote nothing: name fmnet-infer in the add-on's preferences"),
        "garbled": ("\0garbled", "does not run .*: name fmnet-infer in the add-on's preferences"),
        "half": ("#!/bin/sh\n[ $2 = match ] && exec \"$FMNET_BEHIND\" \"$@\"\nexit 3\n", "status 3: it does not say why"),
    }
    monkeypatch.setenv("FMNET_BEHIND", os.path.abspath(settings().program))
    for name, (text, message) in scripts.items():
        use_script(tmp_path / name, text)
        with pytest.raises(RuntimeError, match=message):
            operator()
        assert is_bare(receiver)
    settings().program = str(tmp_path / "nowhere")
    with pytest.raises(RuntimeError, match="no program .*: name fmnet-infer in the add-on's preferences"):
        operator()
