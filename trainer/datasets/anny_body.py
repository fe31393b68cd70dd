"""Bodies at rest: anny's surface as one closed component, its skeleton, and random people made from them.

Axes as in anny: x to the body's left, y to its back, z up; lengths in metres. Everything here is numpy.
"""

import warnings
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

MIRROR = np.array([-1.0, 1.0, 1.0])
RACES = ("african", "asian", "caucasian")


class Unusable(Exception):
    """The installed `anny` does not give what this script needs."""


@dataclass
class Body:
    """One person at rest: vertices [n, 3] and the heads of the bones [b, 3]."""

    vertices: np.ndarray
    heads: np.ndarray


class Skeleton:
    """Names, parents and mirror images of the bones."""

    def __init__(self, names, parents):
        self.names = list(names)
        self.parents = [int(parent) for parent in parents]
        self.index = {name: i for i, name in enumerate(self.names)}
        self.mirror = np.array([self.index[mirrored(name)] for name in self.names])

    def ids(self, *stems):
        """Indices of the bones whose name starts with one of the stems."""
        return [i for i, name in enumerate(self.names) if name.startswith(stems)]


def mirrored(name):
    """The name of a bone's mirror image: `wrist.L` for `wrist.R`."""
    return name[:-1] + {"L": "R", "R": "L"}[name[-1]] if name.endswith((".L", ".R")) else name


class People:
    """Makes random people: one topology, faces [m, 3], skinning weights [n, b], mirror image of each vertex [n]."""

    def __init__(self):
        try:
            import anny
        except ImportError as error:
            raise Unusable(f"{error}: pip install -r requirements.txt") from error
        warnings.filterwarnings("ignore", message="Fallback to lbs skinning")
        self._model = anny.Anny(local_changes="default", phenotypes="all", skinning_method="lbs")
        self.version = anny.__version__
        self.skeleton = Skeleton(self._model.bone_labels, self._model.bone_parents)
        self._keep, self.faces = largest_component(self._model.faces.numpy(), len(self._model.template_vertices))
        check_closed(self.faces)
        self.weights = self._dense_weights()
        self.mirror = mirror_image(self._model.template_vertices.numpy()[self._keep], self.faces)

    def _dense_weights(self):
        weights, bones = self._model.vertex_bone_weights.numpy(), self._model.vertex_bone_indices.numpy()
        dense = np.zeros((len(weights), len(self.skeleton.names)))
        np.add.at(dense, (np.arange(len(weights))[:, None], bones), weights)
        return dense[self._keep]

    def random(self, rng, symmetric):
        """A random person at rest; exactly symmetric if asked for."""
        shape = random_phenotype(rng)
        local = random_local_changes(rng, self._model.local_change_labels, symmetric)
        made = self._model(phenotype_kwargs=shape, local_changes_kwargs=local)
        body = Body(made["rest_vertices"][0].numpy()[self._keep], made["rest_bone_heads"][0].numpy())
        return self.symmetrised(body) if symmetric else body

    def symmetrised(self, body):
        """The mean of a body and its mirror image, so that both agree in every bit."""
        return Body(
            0.5 * (body.vertices + body.vertices[self.mirror] * MIRROR),
            0.5 * (body.heads + body.heads[self.skeleton.mirror] * MIRROR),
        )


def random_phenotype(rng):
    """anny's phenotype parameters, over their whole range; a third are children (age 0 is a baby, 2/3 is young)."""
    shape = {label: rng.uniform() for label in ("gender", "muscle", "weight", "proportions", "cupsize", "firmness")}
    shape["age"] = rng.uniform(0.15, 0.55) if rng.uniform() < 0.35 else rng.uniform(0.55, 1.0)
    shape["height"] = rng.beta(2.0, 2.0)
    if shape["age"] < 0.5:
        shape["cupsize"] = 0.0
    return shape | dict(zip(RACES, rng.dirichlet((0.7, 0.7, 0.7)), strict=True))


def random_local_changes(rng, labels, symmetric):
    """Changes of single parts, -1 to 1: two in five labels, in the same direction left and right."""
    scale = rng.uniform(0.05, 0.6)
    changes = {}
    for label in labels:
        value = np.clip(scale * rng.standard_normal(), -0.8, 0.8) * (rng.uniform() < 0.4)
        uneven = 0.0 if symmetric else 0.05 * scale * rng.standard_normal()
        if label.startswith("r-"):
            changes[label] = changes.get("l-" + label[2:], value) + uneven
        elif "-trans-out" in label and not label.startswith("l-"):
            changes[label] = 0.0 if symmetric else 0.2 * value  # a shift to one side
        else:
            changes[label] = value
    return changes


def largest_component(faces, vertex_count):
    """The vertices of the largest connected component, in order, and its faces over them."""
    edges = directed_edges(faces)
    graph = coo_matrix((np.ones(len(edges)), edges.T), shape=(vertex_count, vertex_count))
    labels = connected_components(graph, directed=False)[1]
    largest = labels == np.bincount(labels).argmax()
    return np.flatnonzero(largest), (np.cumsum(largest) - 1)[faces[largest[faces[:, 0]]]]


def directed_edges(faces):
    """The edges of all faces, as they run around them, [3 m, 2]."""
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def check_closed(faces):
    """Every directed edge occurs once and so does its reverse: closed, consistently oriented, edges manifold."""
    edges = {(int(a), int(b)) for a, b in directed_edges(faces)}
    if len(edges) != 3 * len(faces) or any((b, a) not in edges for a, b in edges):
        raise Unusable("the largest component of anny's surface is not closed and manifold: is this another version?")


def mirror_image(vertices, faces):
    """Each vertex's mirror image in the template, which is symmetric in positions and in triangles."""
    distance, image = cKDTree(vertices).query(vertices * MIRROR)
    if distance.max() > 1e-6 or not np.array_equal(image[image], np.arange(len(vertices))):
        raise Unusable("anny's template is not symmetric: is this another version?")
    turned = np.sort(image[faces], axis=1)
    if not np.array_equal(np.unique(turned, axis=0), np.unique(np.sort(faces, axis=1), axis=0)):
        raise Unusable("anny's triangles are not symmetric: is this another version?")
    return image


def vertex_normals(vertices, faces):
    """Area-weighted unit normals at the vertices, [n, 3]."""
    corners = vertices[faces]
    face_normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(normals, faces[:, corner], face_normals)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
