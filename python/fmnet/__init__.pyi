import os
from pathlib import Path
from typing import Any, Callable, Literal, NamedTuple, Protocol, Union, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str

class _HasMesh(Protocol):
    @property
    def vertices(self) -> Any: ...
    @property
    def faces(self) -> Any: ...

class _HasTargets(Protocol):
    @property
    def targets(self) -> Any: ...

_Path = Union[str, os.PathLike[str]]
_Mesh = Union[_Path, tuple[ArrayLike, ArrayLike], _HasMesh]
_Basis = Union[Eigenbasis, tuple[ArrayLike, ArrayLike, ArrayLike]]
_Map = Union[ArrayLike, _HasTargets]
_Progress = Callable[[str, str, Union[float, None]], object]
_Descriptor = Literal["learned", "shot"]
_Solver = Literal["least-squares", "regularized", "bidirectional", "joint", "part"]
_Refinement = Literal["none", "icp", "zoomout", "wavelet", "pmf", "shared-triangulation"]
_Upscaling = Literal["surface", "l21", "least-squares"]
_Backend = Literal["tract", "native"]
_Effort = Literal["low", "normal", "high"]
_Vertices = Union[int, Literal["off"]]
_Side = Literal["source", "target"]

class Error(ValueError): ...
class FmnetWarning(UserWarning): ...

class Eigenbasis(NamedTuple):
    eigenvalues: NDArray[np.float64]
    eigenvectors: NDArray[np.float64]
    mass: NDArray[np.float64]

class PointMap(NamedTuple):
    targets: NDArray[np.int32]
    confidence: NDArray[np.float32]

class Barycentric(NamedTuple):
    faces: NDArray[np.int32]
    weights: NDArray[np.float64]

class Quality(NamedTuple):
    expected_error: float
    probability_bad: float
    doubtful: bool
    mirrored: bool
    commutativity: float
    orthogonality: float
    dirichlet: float
    stretched: float
    reversed: float
    cycle: float | None
    coverage: float
    agreement: float | None

class Refined(NamedTuple):
    targets: NDArray[np.int32]
    confidence: NDArray[np.float32]
    functional_map: NDArray[np.float64]

@final
class Shape:
    @property
    def name(self) -> str: ...
    @property
    def n_input(self) -> int: ...
    @property
    def area(self) -> float: ...
    @property
    def whole_area(self) -> float | None: ...
    @property
    def vertices(self) -> NDArray[np.float64]: ...
    @property
    def faces(self) -> NDArray[np.uint32]: ...
    @property
    def input_vertices(self) -> NDArray[np.int32]: ...
    @property
    def descriptors(self) -> NDArray[np.float32]: ...
    def eigenbasis(self, k: int) -> Eigenbasis: ...
    def __reduce__(self) -> tuple[Callable[[bytes], Shape], tuple[bytes]]: ...
    @staticmethod
    def _from_bytes(bytes: bytes) -> Shape: ...

@final
class Match:
    @property
    def targets(self) -> NDArray[np.int32]: ...
    @property
    def confidence(self) -> NDArray[np.float32] | None: ...
    @property
    def functional_map(self) -> NDArray[np.float64]: ...
    @property
    def barycentric(self) -> Barycentric | None: ...
    @property
    def followers(self) -> NDArray[np.int32]: ...
    @property
    def quality(self) -> Quality: ...
    @property
    def n_source(self) -> int: ...
    @property
    def n_target(self) -> int: ...
    def save(self, path: _Path, *, key: str | None = None) -> None: ...

@final
class Evaluation:
    @property
    def errors(self) -> NDArray[np.float32]: ...
    @property
    def count(self) -> int: ...
    @property
    def mean(self) -> float: ...
    @property
    def mean_on_surface(self) -> float | None: ...
    @property
    def worst(self) -> float: ...
    @property
    def auc(self) -> float: ...
    @property
    def exact(self) -> float: ...
    @property
    def within_005(self) -> float: ...
    @property
    def coverage(self) -> float: ...
    @property
    def mirrored(self) -> bool: ...

@final
class Matcher:
    def __new__(
        cls,
        model: _Path | None = None,
        *,
        descriptor: _Descriptor = "learned",
        k: int | None = None,
        fm: _Solver | None = None,
        mask_weight: float | None = None,
        refine: _Refinement | None = None,
        upscale: _Upscaling = "surface",
        effort: _Effort = "normal",
        adapt: int | None = None,
        decimate: _Vertices | None = None,
        subdivide: _Vertices | None = None,
        shot_radius: float | None = None,
        cache: _Path | None = None,
        backend: _Backend = "native",
    ) -> Matcher: ...
    @property
    def k(self) -> int: ...
    def describe(
        self,
        mesh: _Mesh,
        *,
        name: str | None = None,
        whole_area: float | None = None,
        progress: _Progress | None = None,
    ) -> Shape: ...
    def match(
        self,
        source: Shape | _Mesh,
        target: Shape | _Mesh,
        *,
        partial: bool = False,
        landmarks: ArrayLike | None = None,
        progress: _Progress | None = None,
    ) -> Match: ...
    def save(self, shape: Shape, path: _Path) -> None: ...
    def load(self, path: _Path) -> Shape: ...
    def map_key(self, source_hash: str, target_hash: str, *, partial: bool = False) -> str: ...

def match(
    source: Shape | _Mesh,
    target: Shape | _Mesh,
    *,
    partial: bool = False,
    landmarks: ArrayLike | None = None,
    progress: _Progress | None = None,
    model: _Path | None = None,
    descriptor: _Descriptor = "learned",
    k: int | None = None,
    fm: _Solver | None = None,
    mask_weight: float | None = None,
    refine: _Refinement | None = None,
    upscale: _Upscaling = "surface",
    effort: _Effort = "normal",
    adapt: int | None = None,
    decimate: _Vertices | None = None,
    subdivide: _Vertices | None = None,
    shot_radius: float | None = None,
    cache: _Path | None = None,
    backend: _Backend = "native",
) -> Match: ...
def features(
    mesh: _Mesh,
    *,
    progress: _Progress | None = None,
    model: _Path | None = None,
    descriptor: _Descriptor = "learned",
    k: int | None = None,
    decimate: _Vertices | None = None,
    shot_radius: float | None = None,
    cache: _Path | None = None,
    backend: _Backend = "native",
) -> dict[str, NDArray[Any]]: ...
def eigenbasis(mesh: _Mesh, k: int, *, unit_area: bool = True) -> Eigenbasis: ...
def shot(
    mesh: _Mesh, *, radius: float = 0.067, bins: int = 10, min_neighbors: int = 5
) -> NDArray[np.float32]: ...
def functional_map(
    source_basis: _Basis,
    target_basis: _Basis,
    source_descriptors: ArrayLike,
    target_descriptors: ArrayLike,
    *,
    fm: _Solver = "bidirectional",
    mask_weight: float | None = None,
) -> NDArray[np.float64]: ...
def point_map(
    functional_map: ArrayLike,
    source_basis: _Basis,
    target_basis: _Basis,
    *,
    comparison: Literal["distance", "adjoint", "joint"] = "adjoint",
) -> PointMap: ...
def zoomout(
    targets: _Map,
    source_basis: _Basis,
    target_basis: _Basis,
    *,
    k_start: int = 60,
    k_step: int = 20,
    k_max: int = 200,
    bidirectional: bool = True,
) -> Refined: ...
def geodesic_distances(mesh: _Mesh, sources: int | ArrayLike | None = None) -> NDArray[np.float32]: ...
def evaluate(
    targets: _Map, truth: _Map, target: _Mesh, *, symmetric_truth: _Map | None = None
) -> Evaluation: ...
def transfer(
    values: ArrayLike, targets: _Map, source: _Mesh, target: _Mesh, *, to: _Side = "source"
) -> NDArray[Any]: ...
def transfer_landmarks(
    landmarks: ArrayLike, targets: _Map, source: _Mesh, target: _Mesh, *, to: _Side = "source"
) -> NDArray[np.int32]: ...
def transfer_uvs(
    corner_uvs: ArrayLike, targets: _Map, source: _Mesh, target: _Mesh, *, to: _Side = "source"
) -> NDArray[np.float32]: ...
def read_pairs(
    pairs: _Path,
    out: _Path,
    *,
    root: _Path | None = None,
    format: Literal["txt", "vts", "npy", "csv"] = "txt",
) -> list[tuple[Path, Path, Path]]: ...
def mesh_hash(mesh: _Mesh) -> str: ...
