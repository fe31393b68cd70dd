"""Blender add-on: carries weights, colours, UVs and shape keys from one object to another of any topology.

Install this one file (Edit > Preferences > Add-ons > Install from Disk), and name the program fmnet-infer in the add-on's
preferences. Select the object that gives, then with Shift the one that receives, and press the button in the sidebar (N) of the
3D view, under fmnet.

The program matches both meshes as they are without modifiers, and does the transfer; nothing is computed here.
"""

import shutil
import subprocess
import tempfile
from pathlib import Path

import bpy
import numpy as np
from bpy.props import BoolProperty, StringProperty

bl_info = {
    "name": "fmnet transfer",
    "description": "Carries weights, colours, UVs and shape keys between meshes of any topology",
    "author": "The fmnet developers",
    "version": (0, 1, 0),
    "blender": (4, 2, 0),
    "location": "3D View > Sidebar > fmnet",
    "category": "Mesh",
}


class ProgramError(Exception):
    """What the program has to say, or that there is none."""


class Program:
    """fmnet-infer in a folder of its own."""

    def __init__(self, name, folder):
        self.path = shutil.which(bpy.path.abspath(name)) or shutil.which(name)
        self.folder = folder
        self.warnings = []
        if self.path is None:
            raise ProgramError(f"no program {name!r}: name fmnet-infer in the add-on's preferences")

    def run(self, *arguments):
        done = subprocess.run(
            [self.path, "--quiet", *arguments], cwd=self.folder, capture_output=True, text=True, errors="replace"
        )
        lines = done.stderr.splitlines()
        self.warnings += [line.removeprefix("warning: ") for line in lines if line.startswith("warning: ")]
        if done.returncode != 0:
            errors = [line.removeprefix("error: ") for line in lines if line.startswith("error: ")]
            raise ProgramError("\n".join(errors) or f"fmnet-infer ended with status {done.returncode}")


# Meshes as arrays.


def array_of(collection, name, width, kind):
    """A property of every element, [n, width]."""
    values = np.empty(len(collection) * width, kind)
    collection.foreach_get(name, values)
    return values.reshape(-1, width)


def vertices_of(data):
    """Vertices without shape keys, [n, 3]."""
    keys = data.shape_keys
    return array_of(keys.reference_key.data if keys else data.vertices, "co", 3, np.float32)


def triangles_of(data):
    """The vertices and the corners (loops) of every triangle, [m, 3] each."""
    data.calc_loop_triangles()
    triangles = data.loop_triangles
    return array_of(triangles, "vertices", 3, np.int32), array_of(triangles, "loops", 3, np.int32)


def write_obj(path, scale, data, uvs=None):
    """Vertices in the scene's unit and triangles; with texture coordinates [loops, 2] of every corner."""
    faces, loops = triangles_of(data)
    with open(path, "w", encoding="ascii") as file:
        np.savetxt(file, vertices_of(data) * scale, fmt="v %.9g %.9g %.9g")
        if uvs is None:
            np.savetxt(file, faces + 1, fmt="f %d %d %d")
        else:
            np.savetxt(file, uvs, fmt="vt %.9g %.9g")
            corners = np.stack([faces + 1, loops + 1], axis=2).reshape(-1, 6)
            np.savetxt(file, corners, fmt="f %d/%d %d/%d %d/%d")


def read_uvs(path):
    """Texture coordinates of the corners of the triangles of an OBJ file, [m, 3, 2]."""
    uvs, corners = [], []
    for line in Path(path).read_text().splitlines():
        words = line.split()
        if words[:1] == ["vt"]:
            uvs.append([float(word) for word in words[1:3]])
        elif words[:1] == ["f"]:
            corners.append([int(word.split("/")[1]) - 1 for word in words[1:4]])
    return np.array(uvs)[np.array(corners)]


# What a vertex has: each kind gives columns [n, q], and takes them on the other object.


def weights_of(giver):
    weights = np.zeros((len(giver.data.vertices), len(giver.vertex_groups)))
    for vertex in giver.data.vertices:
        for group in vertex.groups:
            weights[vertex.index, group.group] = group.weight
    return weights


def set_weights(receiver, giver, weights):
    for group, column in zip(giver.vertex_groups, weights.T):
        own = receiver.vertex_groups.get(group.name) or receiver.vertex_groups.new(name=group.name)
        own.remove(range(len(column)))
        for vertex in np.flatnonzero(column > 1e-4):
            own.add([int(vertex)], float(column[vertex]), "REPLACE")


def colors_of(giver):
    """All colour attributes; one of corners as the mean around each vertex."""
    data = giver.data
    columns = [np.zeros((len(data.vertices), 0))]
    for attribute in data.color_attributes:
        colors = array_of(attribute.data, "color", 4, np.float32)
        if attribute.domain == "CORNER":
            vertex = array_of(data.loops, "vertex_index", 1, np.int32)[:, 0]
            sums = np.zeros((len(data.vertices), 4))
            np.add.at(sums, vertex, colors)
            colors = sums / np.maximum(np.bincount(vertex, minlength=len(sums)), 1)[:, None]
        columns.append(colors)
    return np.concatenate(columns, axis=1)


def set_colors(receiver, giver, colors):
    attributes = receiver.data.color_attributes
    for number, given in enumerate(giver.data.color_attributes):
        own = attributes.get(given.name)
        if own is not None:
            attributes.remove(own)
        own = attributes.new(given.name, given.data_type, "POINT")
        own.data.foreach_set("color", np.ascontiguousarray(colors[:, 4 * number : 4 * number + 4], np.float32).ravel())


def own_keys(data):
    """Shape keys but for the one that the others are relative to."""
    keys = data.shape_keys
    return [key for key in keys.key_blocks if key != keys.reference_key] if keys else []


def moves_of(giver):
    """How far each shape key moves each vertex."""
    rest = vertices_of(giver.data)
    moves = [array_of(key.data, "co", 3, np.float32) - rest for key in own_keys(giver.data)]
    return np.concatenate([np.zeros((len(rest), 0)), *moves], axis=1)


def set_moves(receiver, giver, moves):
    given = own_keys(giver.data)
    if not given:
        return
    if receiver.data.shape_keys is None:
        receiver.shape_key_add(name="Basis", from_mix=False)
    rest = vertices_of(receiver.data)
    # As large on the receiver as on the giver, relative to both.
    factor = np.linalg.norm(np.ptp(rest, axis=0)) / np.linalg.norm(np.ptp(vertices_of(giver.data), axis=0))
    for number, key in enumerate(given):
        own = receiver.data.shape_keys.key_blocks.get(key.name)
        own = own or receiver.shape_key_add(name=key.name, from_mix=False)
        own.slider_min, own.slider_max, own.value = key.slider_min, key.slider_max, key.value
        moved = rest + factor * moves[:, 3 * number : 3 * number + 3]
        own.data.foreach_set("co", np.ascontiguousarray(moved, np.float32).ravel())


KINDS = {
    "weights": (weights_of, set_weights),
    "colors": (colors_of, set_colors),
    "shape_keys": (moves_of, set_moves),
}


def carry_values(program, giver, receiver, kinds):
    """Everything that vertices have, in one table; returns how many columns were carried."""
    tables = [KINDS[kind][0](giver) for kind in kinds]
    table = np.concatenate([np.zeros((len(giver.data.vertices), 0)), *tables], axis=1)
    if table.shape[1] == 0:
        return 0
    np.save(program.folder / "given.npy", table)
    transfer = ["transfer", "receiver.obj", "giver.obj", "--map", "map.txt"]
    program.run(*transfer, "--values", "given.npy", "-o", "received.npy")
    # Vertices without a match have none of it.
    received = np.nan_to_num(np.load(program.folder / "received.npy"), nan=0.0)
    ends = np.cumsum([part.shape[1] for part in tables])
    for kind, part in zip(kinds, np.split(received, ends[:-1], axis=1)):
        KINDS[kind][1](receiver, giver, part)
    return table.shape[1]


def carry_uvs(program, giver, receiver):
    """Every UV map; returns how many."""
    loops = triangles_of(receiver.data)[1]
    for layer in giver.data.uv_layers:
        write_obj(program.folder / "giver_uvs.obj", scale_of(giver), giver.data, array_of(layer.uv, "vector", 2, np.float32))
        program.run("transfer", "receiver.obj", "giver_uvs.obj", "--map", "map.txt", "-o", "received.obj")
        uvs = np.zeros((len(receiver.data.loops), 2), np.float32)
        uvs[loops] = read_uvs(program.folder / "received.obj")
        own = receiver.data.uv_layers.get(layer.name) or receiver.data.uv_layers.new(name=layer.name)
        own.uv.foreach_set("vector", uvs.ravel())
    return len(giver.data.uv_layers)


def scale_of(given):
    """The object's size in the scene, for parts, which have the unit of their whole."""
    return np.array(given.matrix_world.to_scale())


def carry(name, giver, receiver, kinds, with_uvs, partial):
    """Matches and carries everything; returns how much was carried and the program's warnings."""
    with tempfile.TemporaryDirectory(prefix="fmnet-") as folder:
        program = Program(name, Path(folder))
        write_obj(program.folder / "giver.obj", scale_of(giver), giver.data)
        write_obj(program.folder / "receiver.obj", scale_of(receiver), receiver.data)
        program.run("match", "receiver.obj", "giver.obj", "-o", "map.txt", *(["--partial"] if partial else []))
        count = carry_values(program, giver, receiver, kinds)
        count += carry_uvs(program, giver, receiver) if with_uvs else 0
    receiver.data.update()
    return count, program.warnings


class FmnetPreferences(bpy.types.AddonPreferences):
    bl_idname = __name__

    program: StringProperty(
        name="Program", description="fmnet-infer: its path, or its name on the PATH", subtype="FILE_PATH", default="fmnet-infer"
    )

    def draw(self, context):
        self.layout.prop(self, "program")


class OBJECT_OT_fmnet_transfer(bpy.types.Operator):
    """Carry over from the selected object to the active one, whatever their topologies"""

    bl_idname = "object.fmnet_transfer"
    bl_label = "Transfer from Selected"
    bl_options = {"REGISTER", "UNDO"}

    weights: BoolProperty(name="Weights", description="Vertex groups", default=True)
    colors: BoolProperty(name="Colours", description="Colour attributes, by vertex", default=True)
    uvs: BoolProperty(name="UVs", description="UV maps", default=True)
    shape_keys: BoolProperty(name="Shape keys", description="Both objects have to face the same way", default=True)
    partial: BoolProperty(
        name="Receiver is a part", description="The active object is a part of the selected one, in one unit", default=False
    )

    @classmethod
    def poll(cls, context):
        meshes = [o for o in context.selected_objects if o.type == "MESH"]
        is_mesh = context.object is not None and context.object.type == "MESH"
        return context.mode == "OBJECT" and is_mesh and len(meshes) == 2 and context.object in meshes

    def execute(self, context):
        receiver = context.object
        giver = next(o for o in context.selected_objects if o != receiver and o.type == "MESH")
        name = context.preferences.addons[__name__].preferences.program
        kinds = [kind for kind in KINDS if getattr(self, kind)]
        try:
            count, warnings = carry(name, giver, receiver, kinds, self.uvs, self.partial)
        except (ProgramError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for warning in warnings:
            self.report({"WARNING"}, warning)
        if count == 0:
            self.report({"WARNING"}, f"{giver.name} has nothing of what is ticked")
        return {"FINISHED"}


class VIEW3D_PT_fmnet(bpy.types.Panel):
    bl_label = "fmnet"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "fmnet"

    def draw(self, context):
        self.layout.operator(OBJECT_OT_fmnet_transfer.bl_idname)


CLASSES = (FmnetPreferences, OBJECT_OT_fmnet_transfer, VIEW3D_PT_fmnet)


def register():
    for kind in CLASSES:
        bpy.utils.register_class(kind)


def unregister():
    for kind in reversed(CLASSES):
        bpy.utils.unregister_class(kind)
