"""Matches two meshes with a model of fmnet, in numpy and onnxruntime.

    fmnet-infer features a.ply --out a --model model.onnx
    fmnet-infer features b.ply --out b --model model.onnx
    python match.py a b model.onnx map.txt

Line i of map.txt is the vertex of b.ply that matches vertex i of a.ply, the map of `fmnet-infer match --refine none`. Where the
mesh was repaired or decimated, `features` also writes vertices.npy, and a line belongs to the vertex that is named there.
"""

import sys
from pathlib import Path

import numpy as np
import onnxruntime


class Shape:
    """The eigenbasis [n, k] of a shape scaled to unit area, and its learned descriptors [n, 352]."""

    def __init__(self, folder, session):
        folder = Path(folder)
        mass = np.load(folder / "mass.npy")
        area = mass.sum()
        self.mass = mass / area
        self.eigenvalues = np.load(folder / "eigenvalues.npy") * area
        self.eigenvectors = np.load(folder / "eigenvectors.npy") * np.sqrt(area)
        (self.descriptors,) = session.run(["descriptors"], {"shot": np.load(folder / "shot.npy")})
        renumbered = folder / "vertices.npy"
        self.vertices = np.load(renumbered) if renumbered.exists() else np.arange(len(mass))

    def coefficients(self):
        """Fourier coefficients of the descriptors, [k, 352]."""
        return self.eigenvectors.T @ (self.mass[:, None] * self.descriptors)


def resolvent_mask(source, target):
    """How little each entry [k_target, k_source] of a map that commutes with the Laplacians is used (Ren et al. 2019)."""
    largest = max(source.eigenvalues.max(), target.eigenvalues.max())

    def resolvent(shape):
        g = np.sqrt(np.maximum(shape.eigenvalues, 0) / largest)
        return (g + 1j) / (g**2 + 1)

    return np.abs(resolvent(target)[:, None] - resolvent(source)[None, :]) ** 2


def regularized(source, target, mask_weight=0.03):
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


def point_map(source, target, solver):
    """For each row of the source the row of the target that matches it."""
    phi, psi = source.eigenvectors, target.eigenvectors
    if solver == "least-squares":
        C = np.linalg.lstsq(source.coefficients().T, target.coefficients().T, rcond=None)[0].T
        return nearest(phi @ C.T, psi)
    # Both directions: the map back, transposed, is another estimate of C.
    C = (regularized(source, target) + regularized(target, source).T) / 2
    return nearest(phi, psi @ C)


def main():
    folder_source, folder_target, model, out = sys.argv[1:]
    session = onnxruntime.InferenceSession(model, providers=["CPUExecutionProvider"])
    metadata = session.get_modelmeta().custom_metadata_map
    source, target = Shape(folder_source, session), Shape(folder_target, session)
    matches = point_map(source, target, metadata["fmnet.solver"])
    np.savetxt(out, target.vertices[matches], fmt="%d")


if __name__ == "__main__":
    main()
