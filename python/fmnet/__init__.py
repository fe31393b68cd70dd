"""Dense correspondence between deformable 3D shapes: two meshes in, a dense map out.

``match(source, target)`` matches two meshes; a ``Matcher`` loads the model once and describes each shape once, for many. The
single stages stand beside them, on plain arrays: ``features``, ``eigenbasis``, ``shot``, ``functional_map``, ``point_map``,
``zoomout``, ``geodesic_distances``, ``evaluate``, ``transfer``, ``transfer_landmarks``, ``transfer_uvs``.

The source is the shape whose vertices are matched, the target the one that they are matched to. Vertices count from 0. Sizes
stand in brackets: [n, 3]. What is wrong with an input raises ``fmnet.Error``, a ``ValueError``; what the system refuses is an
``OSError``.
"""

from typing import NamedTuple as _NamedTuple

from ._fmnet import (
    Error,
    Evaluation,
    FmnetWarning,
    Match,
    Matcher,
    Shape,
    __version__,
    eigenbasis,
    evaluate,
    features,
    functional_map,
    geodesic_distances,
    match,
    mesh_hash,
    point_map,
    read_pairs,
    shot,
    transfer,
    transfer_landmarks,
    transfer_uvs,
    zoomout,
)


class Eigenbasis(_NamedTuple):
    """The first ``k`` eigenpairs of the Laplace-Beltrami operator."""

    eigenvalues: "object"
    """ndarray of float64, [k] : Eigenvalues, ascending."""
    eigenvectors: "object"
    """ndarray of float64, [n, k] : Eigenvectors as columns, orthonormal with respect to ``mass``."""
    mass: "object"
    """ndarray of float64, [n] : Area of each vertex."""


class PointMap(_NamedTuple):
    """A map from the source's vertices to the target's."""

    targets: "object"
    """ndarray of int32, [n_source] : Target vertices, -1 where there is none."""
    confidence: "object"
    """ndarray of float32, [n_source] : From 0 to 1."""


class Barycentric(_NamedTuple):
    """Points on a surface: ``(weights[:, :, None] * vertices[target_faces[faces]]).sum(axis=1)`` are their positions."""

    faces: "object"
    """ndarray of int32, [n_source] : Triangle of the target, -1 where there is none."""
    weights: "object"
    """ndarray of float64, [n_source, 3] : Weights of its corners, of sum 1; 0 where there is no triangle."""


class Quality(_NamedTuple):
    """How good a map is, told without ground truth; the names are those of ``fmnet-infer match --json``."""

    expected_error: float
    """Mean geodesic error to expect, in units of sqrt(area), times 100."""
    probability_bad: float
    """Probability that it is above 10."""
    doubtful: bool
    """Whether the map should not be used without a look."""
    mirrored: bool
    """Whether the map turns the surface inside out."""
    commutativity: float
    """How far the functional map is from commuting with the Laplacians, from 0 to 1."""
    orthogonality: float
    """How far the functional map is from orthogonal."""
    dirichlet: float
    """Dirichlet energy of the target's coordinates on the source; 2 for an isometry."""
    stretched: float
    """Share of the source's edges that are stretched more than five times."""
    reversed: float
    """Share of the source's area whose orientation is reversed."""
    cycle: "float | None"
    """Mean distance from a vertex to where the map there and back takes it, relative to sqrt(area)."""
    coverage: float
    """Share of the target's area that is matched."""
    agreement: "float | None"
    """Mean cosine between the model's descriptors of matches; None for parts and where SHOT alone is used."""


class Refined(_NamedTuple):
    """A refined map."""

    targets: "object"
    """ndarray of int32, [n_source] : Target vertices."""
    confidence: "object"
    """ndarray of float32, [n_source] : From 0 to 1."""
    functional_map: "object"
    """ndarray of float64, [k_target, k_source] : The functional map that the point map was recovered from."""


__all__ = [name for name in dir() if not name.startswith("_")]
