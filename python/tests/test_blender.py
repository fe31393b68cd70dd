"""The Blender add-on, in Blender as a Python module (PyPI: bpy); skipped where that is not installed."""

import os
import shutil
import sys

import numpy as np
import pytest

from conftest import ROOT, sphere

bpy = pytest.importorskip("bpy")
sys.path.insert(0, str(ROOT / "examples" / "blender"))
pytestmark = pytest.mark.filterwarnings("default")


@pytest.fixture
def operator():
    """The add-on, enabled, with the program named in its preferences."""
    import addon_utils

    program = os.environ.get("FMNET_INFER") or str(ROOT / "target" / "release" / "fmnet-infer")
    if shutil.which(program) is None:
        pytest.skip("no fmnet-infer: build it or name it in FMNET_INFER")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert addon_utils.enable("fmnet_transfer", default_set=True) is not None
    preferences = bpy.context.preferences.addons["fmnet_transfer"].preferences
    preferences.program = program
    yield bpy.ops.object.fmnet_transfer
    addon_utils.disable("fmnet_transfer", default_set=True)


def add(name, vertices, faces, scale=1.0):
    data = bpy.data.meshes.new(name)
    data.from_pydata(vertices.tolist(), [], [list(map(int, f)) for f in faces])
    new = bpy.data.objects.new(name, data)
    new.scale = (scale,) * 3
    bpy.context.collection.objects.link(new)
    return new


def select(giver, receiver):
    for each in bpy.data.objects:
        each.select_set(each in (giver, receiver))
    bpy.context.view_layer.objects.active = receiver
    bpy.context.view_layer.update()


def pair():
    """A bumpy ball with everything, and a larger copy of it in another order."""
    vertices, faces = sphere(3)
    order = np.random.default_rng(0).permutation(len(vertices))
    place = np.argsort(order)
    giver = add("giver", vertices, faces)
    receiver = add("receiver", vertices[order] * 2, place[faces][::-1], scale=0.5)
    return giver, receiver, vertices, order


def dress(giver, vertices):
    data = giver.data
    for name, axis in [("left", 0), ("up", 2)]:
        group = giver.vertex_groups.new(name=name)
        for v, position in enumerate(vertices):
            if position[axis] > 0:
                group.add([v], float(min(position[axis], 1)), "REPLACE")
    colors = data.color_attributes.new("tint", "FLOAT_COLOR", "POINT")
    tint = np.column_stack([vertices * 0.3 + 0.5, np.ones(len(vertices))]).astype(np.float32)
    colors.data.foreach_set("color", tint.ravel())
    layer = data.uv_layers.new(name="map")
    loops = np.array([loop.vertex_index for loop in data.loops])
    layer.uv.foreach_set("vector", (vertices[loops][:, :2] * 0.2 + 0.5).astype(np.float32).ravel())
    giver.shape_key_add(name="Basis")
    key = giver.shape_key_add(name="grow")
    key.data.foreach_set("co", (vertices * 1.5).astype(np.float32).ravel())
    key.value = 0.25
    return tint


def read(collection, name, width):
    values = np.empty(len(collection) * width, np.float32)
    collection.foreach_get(name, values)
    return values.reshape(-1, width)


def test_everything_is_carried_over(operator):
    giver, receiver, vertices, order = pair()
    tint = dress(giver, vertices)
    select(giver, receiver)
    assert operator() == {"FINISHED"}
    assert [group.name for group in receiver.vertex_groups] == ["left", "up"]
    for name, axis in [("left", 0), ("up", 2)]:
        index = receiver.vertex_groups[name].index
        found = np.zeros(len(order))
        for vertex in receiver.data.vertices:
            for group in vertex.groups:
                if group.group == index:
                    found[vertex.index] = group.weight
        expected = np.clip(vertices[order][:, axis], 0, 1)
        assert np.abs(found - expected).mean() < 0.01
    colors = receiver.data.color_attributes["tint"]
    assert colors.domain == "POINT"
    assert np.abs(read(colors.data, "color", 4) - tint[order]).mean() < 0.01
    loops = np.array([loop.vertex_index for loop in receiver.data.loops])
    uvs = read(receiver.data.uv_layers["map"].uv, "vector", 2)
    assert np.abs(uvs - (vertices[order][loops][:, :2] * 0.2 + 0.5)).mean() < 0.01
    key = receiver.data.shape_keys.key_blocks["grow"]
    assert key.value == 0.25
    assert np.abs(read(key.data, "co", 3) - vertices[order] * 3).mean() < 0.05
    # Once more, over what is there.
    select(giver, receiver)
    assert operator() == {"FINISHED"}
    assert len(receiver.vertex_groups) == 2 and len(receiver.data.color_attributes) == 1
    assert len(receiver.data.shape_keys.key_blocks) == 2


def test_only_what_is_ticked(operator):
    giver, receiver, vertices, _ = pair()
    dress(giver, vertices)
    select(giver, receiver)
    assert operator(weights=False, uvs=False, shape_keys=False) == {"FINISHED"}
    assert not receiver.vertex_groups and not receiver.data.uv_layers and receiver.data.shape_keys is None
    assert len(receiver.data.color_attributes) == 1


def test_colours_of_corners_and_polygons(operator):
    vertices, faces = sphere(3)
    giver, receiver = add("giver", vertices, faces), add("receiver", vertices, faces)
    colors = giver.data.color_attributes.new("corners", "BYTE_COLOR", "CORNER")
    loops = np.array([loop.vertex_index for loop in giver.data.loops])
    tint = np.column_stack([vertices * 0.3 + 0.5, np.ones(len(vertices))]).astype(np.float32)
    colors.data.foreach_set("color", tint[loops].ravel())
    select(giver, receiver)
    assert operator() == {"FINISHED"}
    assert np.abs(read(receiver.data.color_attributes["corners"].data, "color", 4) - tint).mean() < 0.02


def test_what_is_wrong_is_reported(operator):
    giver, receiver, *_ = pair()
    select(giver, receiver)
    flat = add("flat", np.zeros((3, 3)), np.array([[0, 1, 2]]))
    select(giver, flat)
    with pytest.raises(RuntimeError, match="receiver.obj"):
        operator()
    bpy.context.preferences.addons["fmnet_transfer"].preferences.program = "/nowhere/fmnet-infer"
    select(giver, receiver)
    with pytest.raises(RuntimeError, match="name fmnet-infer in the add-on's preferences"):
        operator()
    select(giver, giver)
    assert not operator.poll()
