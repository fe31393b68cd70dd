"""Times NumPy and pyFM on what `cargo bench --workspace --bench fmap -- --export DIR` wrote.

    OMP_NUM_THREADS=1 python benches/peers/fmap.py DIR

NumPy solves the functional map by least squares, and with the resolvent mask row by row; pyFM (PyPI: pyfmaps) reads the point
map off and refines it with ZoomOut.
"""

import common
import numpy as np

#: Relative difference of functional maps that counts as agreement.
TOLERANCE = 1e-6
#: Share of equal matches that counts as agreement after the rounds of ZoomOut, where a tie broken otherwise goes on.
SHARE = 0.999
#: Eigenfunctions of the map that is read off, as in the bench.
K_MAP = 100
#: Those of ZoomOut, as in the bench.
K_START, K_STEP, K_MAX = 60, 20, 200
MASK_WEIGHT = 0.1


class Shape:
    """Eigenvalues [k], eigenvectors [n, k] and vertex areas [n] at unit area, and the descriptors' coefficients [k, d]."""

    def __init__(self, folder, name):
        self.eigenvalues, self.eigenvectors, self.mass, self.coefficients = (
            common.load(folder, f"{name}-{what}") for what in ("eigenvalues", "eigenvectors", "mass", "coefficients")
        )


def least_squares(source, target, k):
    F, G = source.coefficients[:k], target.coefficients[:k]
    return np.linalg.lstsq(F.T, G.T, rcond=None)[0].T


def resolvent_mask(source, target):
    """[k_target, k_source] (Ren et al. 2019)."""
    largest = max(source.max(), target.max())
    g = [np.sqrt(np.maximum(values, 0) / largest) for values in (source, target)]
    of_source, of_target = ((x + 1j) / (x**2 + 1) for x in g)
    return np.abs(of_target[:, None] - of_source[None, :]) ** 2


def regularised(source, target, k):
    """Each row of C has a system of its own: (F F^T + weight diag(mask_i)) c_i = F g_i."""
    F, G = source.coefficients[:k], target.coefficients[:k]
    gram = F @ F.T
    weight = MASK_WEIGHT * np.trace(gram) / k
    systems = gram + weight * resolvent_mask(source.eigenvalues[:k], target.eigenvalues[:k])[:, :, None] * np.eye(k)
    return np.linalg.solve(systems, (G @ F.T)[:, :, None])[:, :, 0]


def main():
    arguments = common.options(__doc__)
    folder = arguments.folder / "fmap"
    source, target = Shape(folder, "source"), Shape(folder, "target")
    runs = 1 if arguments.quick else 3
    for name, solve in (("least squares", least_squares), ("regularised", regularised)):
        for k in (70, K_MAP):
            cost, c = common.least(runs, lambda: solve(source, target, k))
            ours = common.load(folder, f"{name}-{k}")
            difference = np.abs(c - ours).max() / np.abs(ours).max()
            common.tell(
                f"fmap-{name}-{k}", "numpy", cost, f"maps within {difference:.0e}", difference < TOLERANCE
            )
    pyfm = common.package("pyFM")
    if pyfm is not None:
        refine(folder, source, target, runs)


def refine(folder, source, target, runs):
    """pyFM's maps go the other way: its shape 2 is our source, and its functional map the transpose of ours."""
    from pyFM.refine.zoomout import zoomout_refine
    from pyFM.spectral.convert import FM_to_p2p, p2p_to_FM

    phi, psi = source.eigenvectors, target.eigenvectors
    c = common.load(folder, f"regularised-{K_MAP}")
    cost, index = common.least(
        runs, lambda: FM_to_p2p(c.T, psi, phi, use_adj=True, n_jobs=common.THREADS)
    )
    moved = phi[:, :K_MAP] @ c.T

    def squared_distance(queries, rows):
        return ((moved[queries] - psi[rows, :K_MAP]) ** 2).sum(axis=1)

    ours = common.load(folder, "point map")
    common.tell("fmap-point map", "pyFM", cost, *common.same_targets(ours, index, squared_distance))

    def zoomout():
        start = p2p_to_FM(ours, psi[:, :K_START], phi[:, :K_START], A2=source.mass)
        rounds = (K_MAX - K_START) // K_STEP
        return zoomout_refine(
            start, psi, phi, nit=rounds, step=K_STEP, A2=source.mass, return_p2p=True, n_jobs=common.THREADS
        )[1]

    cost, index = common.least(1, zoomout)
    share = (index == common.load(folder, "zoomout")).mean()
    common.tell("fmap-zoomout", "pyFM", cost, f"{100 * share:.2f} % of the matches equal", share >= SHARE)
    common.tell("fmap-wavelet filter, both directions", "pyFM, ZoomOut, one direction", cost, "another method", None)


if __name__ == "__main__":
    main()
