"""Blender add-on: carries weights, colours, UVs and shape keys from one object to another of any topology.

Install this one file (Edit > Preferences > Add-ons > Install from Disk), and name the program fmnet-infer in the add-on's
preferences. Select the object that gives, then with Shift the one that receives, and press the button in the sidebar (N) of the
3D view, under fmnet.

The program matches both meshes as they stand in the scene, without modifiers and shape keys, and does the transfer.
"""

import os
import shutil
import subprocess
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import bpy
import numpy as np
from bpy.props import BoolProperty, StringProperty

bl_info = {
    "name": "fmnet transfer",
    "description": "Carries weights, colours, UVs and shape keys between meshes of any topology",
    "author": "The fmnet developers",
    "version": (0, 2, 0),
    "blender": (4, 2, 0),
    "location": "3D View > Sidebar > fmnet",
    "category": "Mesh",
}

# Modifiers after which there is more or less of the mesh than was matched.
RESHAPING = {"ARRAY", "BOOLEAN", "BUILD", "MASK", "MIRROR", "NODES", "REMESH", "SCREW", "SKIN"}


class TransferError(Exception):
    """What the user has to change, or what the program has to say."""


@dataclass
class Pair:
    """Who gives and who receives, and what there is to say of it."""

    giver: bpy.types.Object
    receiver: bpy.types.Object
    partial: bool = False
    thorough: bool = False
    warnings: list = field(default_factory=list)

    def check(self):
        """Fails where nothing can be carried; warns where it is less than it seems."""
        for each in (self.giver, self.receiver):
            if each.mode != "OBJECT":
                raise TransferError(f"{each.name} is in another mode: set it to Object Mode")
            if not each.data.polygons:
                raise TransferError(f"{each.name} has no faces: choose a mesh with a surface")
            if abs(np.linalg.det(axes_of(each))) < 1e-30:
                raise TransferError(f"{each.name} has a scale of 0: give it another in the sidebar, under Item")
            self.warn_of_modifiers(each)
        if self.giver.data == self.receiver.data:
            raise TransferError("both objects have the same mesh: Object > Relations > Make Single User > Object & Data")
        if not (self.receiver.is_editable and self.receiver.data.is_editable):
            raise TransferError(f"{self.receiver.name} is linked from another file: Object > Relations > Make Local")
        if self.receiver.data.users > 1:
            self.warn(f"other objects have the mesh of {self.receiver.name} too and change with it")

    def warn(self, text):
        if text not in self.warnings:
            self.warnings.append(text)

    def warn_of_modifiers(self, each):
        names = [m.name for m in each.modifiers if m.show_viewport and m.type in RESHAPING and not is_shading(m)]
        if names:
            self.warn(f"{each.name} was matched without its modifiers: if the map is bad, apply first {', '.join(names)}")

    def warn_of_name(self, what, name, own):
        """Whether it could be made; Blender gives another name, or nothing, where something else has this one."""
        if own is None:
            self.warn(f"{what} {name} was not carried: {self.receiver.name} has too many, or something else of this name")
        elif own.name != name:
            self.warn(f"{what} {name} is called {own.name} on {self.receiver.name}, where something else has the name")
        return own is not None


def is_shading(modifier):
    """Blender's own nodes for shading, which leave the mesh as it is."""
    group = getattr(modifier, "node_group", None)
    return modifier.type == "NODES" and (group is None or group.name.startswith("Smooth by Angle"))


class Program:
    """fmnet-infer in a folder of its own."""

    def __init__(self, name, folder, pair):
        found = shutil.which(bpy.path.abspath(name))
        self.folder = folder
        self.pair = pair
        if found is None:
            raise TransferError(f"no program {name!r}: name fmnet-infer in the add-on's preferences")
        # It runs in another folder.
        self.path = os.path.abspath(found)

    def run(self, *arguments, output):
        """Runs a command that writes the output; returns its path."""
        lines = self.call("--quiet", *arguments, "-o", output)
        for line in lines:
            if line.startswith("warning: "):
                self.pair.warn(self.named(line.removeprefix("warning: ")))
        if not (self.folder / output).exists():
            raise TransferError(f"{self.path} wrote nothing: name fmnet-infer in the add-on's preferences")
        return self.folder / output

    def call(self, *arguments):
        # On Windows without a console of its own.
        flags = getattr(subprocess, "CREATE_NO_WINDOW", 0)
        text = {"capture_output": True, "encoding": "utf-8", "errors": "replace"}
        try:
            done = subprocess.run([self.path, *arguments], cwd=self.folder, creationflags=flags, **text)
        except OSError as error:
            raise TransferError(f"{self.path} does not run ({error}): name fmnet-infer in the add-on's preferences") from error
        lines = done.stderr.splitlines()
        if done.returncode != 0:
            errors = [line.removeprefix("error: ") for line in lines if line.startswith("error: ")] or lines[-3:]
            why = self.named("\n".join(errors) or "it does not say why")
            raise TransferError(f"fmnet-infer failed with status {done.returncode}: {why}")
        return lines

    def named(self, text):
        """With the names that things have in Blender."""
        giver, receiver = self.pair.giver.name, self.pair.receiver.name
        names = {"giver_uvs.obj": giver, "giver.obj": giver, "receiver.obj": receiver, "--effort high": "Thorough"}
        for file, name in names.items():
            text = text.replace(file, name)
        return text


# Meshes as arrays.


def array_of(collection, name, width, kind):
    """A property of every element, [n, width]."""
    values = np.empty(len(collection) * width, kind)
    collection.foreach_get(name, values)
    return values.reshape(-1, width)


def axes_of(given):
    """The object's axes in the scene as columns, [3, 3]; where it stands does not matter."""
    return np.array(given.matrix_world.to_3x3())


def vertices_of(data):
    """Vertices without shape keys, [n, 3]."""
    keys = data.shape_keys
    return array_of(keys.reference_key.data if keys else data.vertices, "co", 3, np.float32)


def triangles_of(data):
    """The vertices, the corners (loops) and the polygon of every triangle: [m, 3], [m, 3] and [m]."""
    data.calc_loop_triangles()
    triangles = data.loop_triangles
    vertices, loops = array_of(triangles, "vertices", 3, np.int32), array_of(triangles, "loops", 3, np.int32)
    return vertices, loops, array_of(triangles, "polygon_index", 1, np.int32)[:, 0]


def size_of(given):
    """The square root of the area in the scene, which poses and loose vertices do not change."""
    a, b, c = (vertices_of(given.data) @ axes_of(given).T)[triangles_of(given.data)[0].T]
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() ** 0.5


def write_obj(path, given, uvs=None):
    """The mesh as it stands in the scene, in triangles; with texture coordinates [loops, 2] of every corner."""
    faces, loops, _ = triangles_of(given.data)
    axes = axes_of(given)
    if np.linalg.det(axes) < 0:
        # Mirrored: the outside stays outside.
        faces, loops = faces[:, ::-1], loops[:, ::-1]
    with open(path, "w", encoding="ascii") as file:
        np.savetxt(file, vertices_of(given.data) @ axes.T, fmt="v %.9g %.9g %.9g")
        if uvs is None:
            np.savetxt(file, faces + 1, fmt="f %d %d %d")
        else:
            np.savetxt(file, uvs, fmt="vt %.9g %.9g")
            corners = np.stack([faces + 1, loops + 1], axis=2).reshape(-1, 6)
            np.savetxt(file, corners, fmt="f %d/%d %d/%d %d/%d")
    return loops


def read_uvs(path):
    """Texture coordinates of the corners of the triangles of an OBJ file, [m, 3, 2]."""
    uvs, corners = [], []
    with open(path, encoding="utf-8", errors="replace") as file:
        for line in file:
            words = line.split()
            if words[:1] == ["vt"]:
                uvs.append([float(word) for word in words[1:3]])
            elif words[:1] == ["f"]:
                corners.append([int(word.split("/")[1]) - 1 for word in words[1:4]])
    return np.array(uvs)[np.array(corners)]


# What a vertex has: each kind gives columns [n, q], and takes them on the receiver; the latter returns how many things it took.


def weights_of(pair):
    weights = np.zeros((len(pair.giver.data.vertices), len(pair.giver.vertex_groups)))
    for vertex in pair.giver.data.vertices:
        for group in vertex.groups:
            weights[vertex.index, group.group] = group.weight
    return weights


def set_weights(pair, weights):
    groups, count = pair.receiver.vertex_groups, 0
    for group, column in zip(pair.giver.vertex_groups, weights.T):
        own = groups.get(group.name) or groups.new(name=group.name)
        if own.lock_weight:
            pair.warn(f"vertex group {group.name} was not carried: it is locked on {pair.receiver.name}, unlock it")
            continue
        pair.warn_of_name("vertex group", group.name, own)
        own.remove(range(len(column)))
        for vertex in np.flatnonzero(column > 1e-4):
            own.add([int(vertex)], float(column[vertex]), "REPLACE")
        count += 1
    return count


def vertex_of_corners(data):
    return array_of(data.loops, "vertex_index", 1, np.int32)[:, 0]


def colors_of(pair):
    """All colour attributes; one of corners as the mean around each vertex."""
    data = pair.giver.data
    columns = [np.zeros((len(data.vertices), 0))]
    for attribute in data.color_attributes:
        colors = array_of(attribute.data, "color", 4, np.float32)
        if attribute.domain == "CORNER":
            vertex, corners = vertex_of_corners(data), colors
            sums = np.zeros((len(data.vertices), 4))
            np.add.at(sums, vertex, corners)
            colors = sums / np.maximum(np.bincount(vertex, minlength=len(sums)), 1)[:, None]
            if np.abs(corners - colors[vertex]).max() > 0.01:
                pair.warn(f"hard borders in colour attribute {attribute.name} became soft: colours are carried by vertex")
        columns.append(colors)
    return np.concatenate(columns, axis=1)


def set_colors(pair, colors):
    data, count = pair.receiver.data, 0
    for number, given in enumerate(pair.giver.data.color_attributes):
        own = data.color_attributes.get(given.name) or data.color_attributes.new(given.name, given.data_type, "POINT")
        if not pair.warn_of_name("colour attribute", given.name, own):
            continue
        values = colors[:, 4 * number : 4 * number + 4]
        if own.domain == "CORNER":
            values = values[vertex_of_corners(data)]
        if own.data_type == "BYTE_COLOR" and np.abs(values - values.clip(0, 1)).max() > 0.001:
            pair.warn(f"colours of {given.name} beyond 0 to 1 were cut off: remove what {pair.receiver.name} has of this name")
        own.data.foreach_set("color", np.ascontiguousarray(values, np.float32).ravel())
        count += 1
    return count


def own_keys(data):
    """Shape keys but for the one of the mesh at rest."""
    keys = data.shape_keys
    return [key for key in keys.key_blocks if key != keys.reference_key] if keys else []


def moves_of(pair):
    """How far each shape key moves each vertex in the scene."""
    data = pair.giver.data
    keys = own_keys(data)
    if keys and not data.shape_keys.use_relative:
        pair.warn(f"the shape keys of {pair.giver.name} are absolute; they were carried as relative ones")
    if keys and data.shape_keys.animation_data:
        pair.warn("drivers and animation of shape keys were not carried: copy them, or set them again")
    moves = [array_of(key.data, "co", 3, np.float32) - array_of(key.relative_key.data, "co", 3, np.float32) for key in keys]
    moves = [each @ axes_of(pair.giver).T for each in moves]
    return np.concatenate([np.zeros((len(data.vertices), 0)), *moves], axis=1)


def set_moves(pair, moves):
    given, receiver = own_keys(pair.giver.data), pair.receiver
    if not given:
        return 0
    if receiver.data.shape_keys is None:
        receiver.shape_key_add(name="Basis", from_mix=False)
    if not receiver.data.shape_keys.use_relative:
        pair.warn(f"the shape keys of {receiver.name} are absolute: tick Relative, or the new ones do nothing")
    rest = vertices_of(receiver.data)
    # As large on the receiver as on the giver, relative to both; a part has the unit of its whole.
    factor = 1 if pair.partial else size_of(receiver) / size_of(pair.giver)
    back = factor * np.linalg.inv(axes_of(receiver)).T
    for number, key in enumerate(given):
        own = key_named(pair, key.name)
        moved = rest + moves[:, 3 * number : 3 * number + 3] @ back
        own.data.foreach_set("co", np.ascontiguousarray(moved, np.float32).ravel())
        set_slider(pair, own, key)
    return len(given)


def key_named(pair, name):
    """The receiver's shape key of this name, or a new one; never the mesh at rest."""
    keys = pair.receiver.data.shape_keys
    own = keys.key_blocks.get(name)
    if own is None or own == keys.reference_key:
        own = pair.receiver.shape_key_add(name=name, from_mix=False)
    pair.warn_of_name("shape key", name, own)
    own.relative_key = keys.reference_key
    return own


def set_slider(pair, own, key):
    # Each end is held within the other: first as wide as Blender allows.
    own.slider_min, own.slider_max = -10, 10
    own.slider_min, own.slider_max = key.slider_min, key.slider_max
    own.value, own.mute = key.value, key.mute
    own.vertex_group = key.vertex_group if key.vertex_group in pair.receiver.vertex_groups else ""
    if own.vertex_group != key.vertex_group:
        pair.warn(f"shape key {key.name} is bound to vertex group {key.vertex_group}: carry the weights too")


KINDS = {
    "weights": ("vertex groups", weights_of, set_weights),
    "colors": ("colour attributes", colors_of, set_colors),
    "shape_keys": ("shape keys", moves_of, set_moves),
}


def carried_values(program, pair, kinds):
    """What the receiver's vertices get of each kind, {kind: [n, q]}; nothing of it is set yet."""
    tables = [KINDS[kind][1](pair) for kind in kinds]
    table = np.concatenate([np.zeros((len(pair.giver.data.vertices), 0)), *tables], axis=1)
    if table.shape[1] == 0:
        return {}
    np.save(program.folder / "given.npy", table)
    transfer = ["transfer", "receiver.obj", "giver.obj", "--map", "map.npz", "--values", "given.npy"]
    # Vertices without a match have none of it.
    received = np.nan_to_num(np.load(program.run(*transfer, output="received.npy")), nan=0.0)
    ends = np.cumsum([part.shape[1] for part in tables])
    return dict(zip(kinds, np.split(received, ends[:-1], axis=1)))


def carried_uvs(program, pair, loops):
    """Every UV map of the giver by its name, for the receiver's corners in triangles [m, 3]: {name: [loops, 2]}."""
    received = {}
    for layer in pair.giver.data.uv_layers:
        write_obj(program.folder / "giver_uvs.obj", pair.giver, array_of(layer.uv, "vector", 2, np.float32))
        path = program.run("transfer", "receiver.obj", "giver_uvs.obj", "--map", "map.npz", output="received.obj")
        received[layer.name] = uvs_of_corners(pair.receiver, loops, read_uvs(path))
    return received


def uvs_of_corners(receiver, loops, found):
    """Coordinates of every corner, [loops, 2], from those of triangles [m, 3, 2].

    Where the triangles of a polygon are on different sides of a seam, all of it goes on with its largest one.
    """
    uvs = np.zeros((len(receiver.data.loops), 2))
    uvs[loops] = found
    polygon = triangles_of(receiver.data)[2]
    places = vertices_of(receiver.data)[vertex_of_corners(receiver.data)].astype(float)
    for torn in np.unique(polygon[(np.abs(uvs[loops] - found) > 1e-5).any(axis=(1, 2))]):
        first, end = np.searchsorted(polygon, [torn, torn + 1])
        largest = first + np.argmax([area_of(places[triangle]) for triangle in loops[first:end]])
        corners = np.array(receiver.data.polygons[torn].loop_indices)
        uvs[corners] = extended(places[loops[largest]], found[largest], places[corners])
    return uvs


def area_of(points):
    return np.linalg.norm(np.cross(points[1] - points[0], points[2] - points[0]))


def extended(triangle, uvs, points):
    """The coordinates [n, 2] that a triangle's go on to at points [n, 3] beside it."""
    edges = np.linalg.pinv(triangle[1:] - triangle[0])
    return uvs[0] + (points - triangle[0]) @ edges @ (uvs[1:] - uvs[0])


def set_uvs(pair, uvs):
    layers, count = pair.receiver.data.uv_layers, 0
    for name, values in uvs.items():
        own = layers.get(name) or layers.new(name=name)
        if pair.warn_of_name("UV map", name, own):
            own.uv.foreach_set("vector", np.ascontiguousarray(values, np.float32).ravel())
            count += 1
    return count


def match(program, pair):
    """Writes both meshes and the map; returns the receiver's corners in triangles [m, 3]."""
    write_obj(program.folder / "giver.obj", pair.giver)
    loops = write_obj(program.folder / "receiver.obj", pair.receiver)
    options = (["--partial"] if pair.partial else []) + (["--effort", "high"] if pair.thorough else [])
    with np.load(program.run("match", "receiver.obj", "giver.obj", *options, output="map.npz")) as found:
        unmatched = int((found["targets"] < 0).sum())
    if unmatched:
        pair.warn(f"{unmatched} vertices of {pair.receiver.name} have no match and got nothing; their UVs are not to be used")
    return loops


def carry(name, pair, kinds, with_uvs):
    """Matches and carries everything; returns what was carried, in words. The receiver changes only if all goes well."""
    pair.check()
    with tempfile.TemporaryDirectory(prefix="fmnet-") as folder:
        program = Program(name, Path(folder), pair)
        loops = match(program, pair)
        values = carried_values(program, pair, kinds)
        uvs = carried_uvs(program, pair, loops) if with_uvs else {}
    counts = {KINDS[kind][0]: KINDS[kind][2](pair, columns) for kind, columns in values.items()}
    counts["UV maps"] = set_uvs(pair, uvs)
    pair.receiver.data.update()
    return ", ".join(f"{what} ({count})" for what, count in counts.items() if count)


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

    thorough: BoolProperty(name="Thorough", description="Takes longer: tries all ways to a map", default=False)

    @classmethod
    def poll(cls, context):
        meshes = [o for o in context.selected_objects if o.type == "MESH"]
        if context.mode != "OBJECT":
            cls.poll_message_set("Change to Object Mode first")
        elif len(meshes) != 2 or context.object not in meshes:
            cls.poll_message_set("Select two meshes: the one that gives, then with Shift the one that receives")
        else:
            return True
        return False

    def invoke(self, context, _event):
        # What is to be carried is asked first, as a match takes its time.
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context):
        context.view_layer.update()
        receiver = context.object
        giver = next(o for o in context.selected_objects if o != receiver and o.type == "MESH")
        name = context.preferences.addons[__name__].preferences.program
        kinds = [kind for kind in KINDS if getattr(self, kind)]
        pair = Pair(giver, receiver, self.partial, self.thorough)
        try:
            carried = carry(name, pair, kinds, self.uvs)
        except (TransferError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for warning in pair.warnings:
            self.report({"WARNING"}, warning)
        if carried:
            self.report({"INFO"}, f"{receiver.name} got from {giver.name}: {carried}")
        else:
            self.report({"WARNING"}, f"nothing was carried: {giver.name} has nothing of what is ticked")
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
