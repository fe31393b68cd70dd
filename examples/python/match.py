"""Matches two meshes with a model of fmnet, in numpy and onnxruntime.

    pip install -r examples/python/requirements.txt
    fmnet-infer features a.ply --out a --model model.onnx
    fmnet-infer features b.ply --out b --model model.onnx
    python examples/python/match.py a b model.onnx map.txt

Line i of map.txt is the vertex of b.ply that matches vertex i of a.ply, but for ties the map of `fmnet-infer match
--refine none`. Where the mesh was repaired or decimated, `features` also writes vertices.npy, and a line belongs to the
vertex that is named there.
"""

import sys
from pathlib import Path

import numpy as np
import onnxruntime


class Shape:
    """The eigenbasis [n, k] of a shape at unit area, and its learned descriptors [n, d]."""

    def __init__(self, folder, session, k):
        def load(name):
            return np.load(Path(folder) / f"{name}.npy")

        # The model's inputs are quantities of the shape by name, each as wide as the model says.
        inputs = {i.name: as_input(load(i.name), i.shape[-1]) for i in session.get_inputs()}
        (self.descriptors,) = session.run(["descriptors"], inputs)
        self.mass = load("mass")
        self.eigenvalues, self.eigenvectors = load("eigenvalues")[:k], load("eigenvectors")[:, :k]
        renumbered = Path(folder) / "vertices.npy"
        self.vertices = np.load(renumbered) if renumbered.exists() else np.arange(len(self.mass))

    def coefficients(self):
        """Fourier coefficients of the descriptors, [k, d]."""
        return self.eigenvectors.T @ (self.mass[:, None] * self.descriptors)


def as_input(values, width):
    """The first columns in single precision; the last dimension is a name where it counts the vertices."""
    return (values[..., :width] if isinstance(width, int) else values).astype(np.float32)


def resolvent_mask(source, target):
    """How little each entry [k_target, k_source] of a map that commutes with the Laplacians is used (Ren et al. 2019)."""
    largest = max(source.eigenvalues.max(), target.eigenvalues.max())

    def resolvent(shape):
        g = np.sqrt(np.maximum(shape.eigenvalues, 0) / largest)
        return (g + 1j) / (g**2 + 1)

    return np.abs(resolvent(target)[:, None] - resolvent(source)[None, :]) ** 2


def regularized(source, target, mask_weight):
    """C [k_target, k_source] with C F = G for the coefficients F of the source and G of the target, nearly diagonal."""
    F, G = source.coefficients(), target.coefficients()
    gram = F @ F.T
    weight = mask_weight * np.trace(gram) / len(gram)
    # Each row of C has a system of its own: (F F^T + weight diag(mask_i)) c_i = F g_i.
    systems = gram + weight * resolvent_mask(source, target)[:, :, None] * np.eye(len(gram))
    return np.linalg.solve(systems, (G @ F.T)[:, :, None])[:, :, 0]


def nearest(queries, rows):
    """For each query the nearest row."""
    squares = (rows**2).sum(axis=1)
    blocks = np.array_split(queries, len(queries) // 1000 + 1)
    return np.concatenate([(squares - 2 * block @ rows.T).argmin(axis=1) for block in blocks])


def point_map(source, target, solver, mask_weight):
    """For each row of the source the row of the target that matches it."""
    phi, psi = source.eigenvectors, target.eigenvectors
    if solver == "least-squares":
        C = np.linalg.lstsq(source.coefficients().T, target.coefficients().T, rcond=None)[0].T
        return nearest(phi @ C.T, psi)
    if solver == "joint":
        # Both directions beside each other: what either map misses counts.
        forth, back = regularized(source, target, mask_weight), regularized(target, source, mask_weight)
        return nearest(np.hstack([phi @ forth.T, phi]), np.hstack([psi, psi @ back.T]))
    # Both directions: the map back, transposed, is another estimate of C.
    C = (regularized(source, target, 0.03) + regularized(target, source, 0.03).T) / 2
    return nearest(phi, psi @ C)


def main():
    folder_source, folder_target, model, out = sys.argv[1:]
    session = onnxruntime.InferenceSession(model, providers=["CPUExecutionProvider"])
    metadata = session.get_modelmeta().custom_metadata_map
    k = int(metadata["fmnet.k"])
    source, target = Shape(folder_source, session, k), Shape(folder_target, session, k)
    matches = point_map(source, target, metadata["fmnet.solver"], float(metadata["fmnet.mask_weight"]))
    np.savetxt(out, target.vertices[matches], fmt="%d")


if __name__ == "__main__":
    main()
