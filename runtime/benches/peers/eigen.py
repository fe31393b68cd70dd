"""Times scipy's eigsh in shift-invert mode on the meshes that `cargo bench --bench eigen -- --export DIR` wrote.

    OPENBLAS_NUM_THREADS=1 python benches/peers/eigen.py DIR [--largest N]

Prints wall and processor seconds of eigsh alone (the least of several runs) and the largest relative difference between
its eigenvalues and ours. `--largest` leaves bigger meshes out.
"""

import argparse
import pathlib
import resource
import time

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import eigsh


def read_off(path):
    numbers = np.array(path.read_text().split()[1:], dtype=float)
    n, m = int(numbers[0]), int(numbers[1])
    vertices = numbers[3 : 3 + 3 * n].reshape(n, 3)
    faces = numbers[3 + 3 * n :].reshape(m, 4)[:, 1:].astype(int)
    return vertices, faces


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
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--largest", type=int, default=10**9)
    arguments = parser.parse_args()
    print("vertices    k   eigsh s     cpu s   difference")
    cases = sorted(arguments.folder.glob("eigen_*.off"), key=lambda p: [int(x) for x in p.stem.split("_")[1:]])
    for path in cases:
        n, k = (int(x) for x in path.stem.split("_")[1:])
        if n > arguments.largest:
            continue
        stiffness, mass = laplacian(*read_off(path))
        ours = np.loadtxt(path.with_suffix(".txt"))
        area = mass.sum()
        wall, cpu = [], []
        for _ in range(3 if n < 20_000 else 1):
            start, used = time.perf_counter(), resource.getrusage(resource.RUSAGE_SELF).ru_utime
            values, _ = eigsh(stiffness, k, sp.diags(mass).tocsc(), sigma=-1e-2 / area, which="LM")
            wall.append(time.perf_counter() - start)
            cpu.append(resource.getrusage(resource.RUSAGE_SELF).ru_utime - used)
        values = np.sort(values)
        difference = np.abs(values - ours)[1:] / values[1:]
        print(f"{n:8} {k:4} {min(wall):9.3f} {min(cpu):9.3f} {difference.max():12.1e}", flush=True)


if __name__ == "__main__":
    main()
