"""Times scipy's eigsh in shift-invert mode on what `cargo bench --workspace --bench eigen -- --export DIR` wrote.

    OMP_NUM_THREADS=1 python benches/peers/eigen.py DIR
"""

import common
import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import eigsh

#: Relative difference of eigenvalues that counts as agreement.
TOLERANCE = 1e-6
#: Nobody asks scipy for more.
MOST_PAIRS = 200


def laplacian(vertices, faces):
    """Cotangent stiffness and lumped barycentric mass."""
    n = len(vertices)
    rows, columns, weights = [], [], []
    for corner in range(3):
        i, j, k = (faces[:, (corner + c) % 3] for c in range(3))
        u, v = vertices[j] - vertices[i], vertices[k] - vertices[i]
        twice_area = np.linalg.norm(np.cross(u, v), axis=1)
        rows.append(j)
        columns.append(k)
        weights.append(0.5 * np.einsum("ij,ij->i", u, v) / twice_area)
    rows, columns, weights = map(np.concatenate, (rows, columns, weights))
    off = sp.csr_matrix((weights, (rows, columns)), shape=(n, n))
    off = off + off.T
    stiffness = sp.diags(np.asarray(off.sum(axis=1)).ravel()) - off
    mass = np.bincount(faces.ravel(), np.repeat(twice_area / 6, 3), minlength=n)
    return stiffness.tocsc(), mass


def main():
    arguments = common.options(__doc__)
    for folder, (n, k) in common.cases(arguments.folder, "eigen"):
        n, k = int(n), int(k)
        if n > arguments.largest or k > MOST_PAIRS:
            continue
        stiffness, mass = laplacian(common.load(folder, "vertices"), common.load(folder, "faces"))
        shift = -1e-2 / mass.sum()
        runs = 3 if n < 20_000 and not arguments.quick else 1
        cost, (values, _) = common.least(
            runs, lambda: eigsh(stiffness, k, sp.diags(mass).tocsc(), sigma=shift, which="LM")
        )
        values, ours = np.sort(values), common.load(folder, "eigenvalues")
        difference = (np.abs(values - ours)[1:] / values[1:]).max()
        text = f"eigenvalues within {difference:.0e}"
        common.tell(folder.name, "scipy eigsh", cost, text, difference < TOLERANCE)


if __name__ == "__main__":
    main()
