"""Meshes, and the program beside which results are held."""

import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))
from program import program  # noqa: E402, F401


@pytest.fixture(scope="session")
def demo():
    """The two bodies of the demo: files of 2400 vertices, of which the first 1000 correspond by index."""
    folder = ROOT / "runtime" / "demo"
    return folder / "source.ply", folder / "target.ply"


def sphere(subdivisions=3, seed=0):
    """A sphere with bumps: vertices [n, 3], faces [m, 3]; n = 10 * 4**subdivisions + 2."""
    t = (1 + 5**0.5) / 2
    vertices = np.array(
        [[-1, t, 0], [1, t, 0], [-1, -t, 0], [1, -t, 0], [0, -1, t], [0, 1, t], [0, -1, -t], [0, 1, -t],
         [t, 0, -1], [t, 0, 1], [-t, 0, -1], [-t, 0, 1]], dtype=float)  # fmt: skip
    faces = np.array(
        [[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6],
         [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10],
         [8, 6, 7], [9, 8, 1]])  # fmt: skip
    for _ in range(subdivisions):
        edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
        unique, index = np.unique(edges, axis=0, return_inverse=True)
        middle = index.reshape(3, -1).T + len(vertices)
        vertices = np.concatenate([vertices, vertices[unique].mean(axis=1)])
        a, b, c = faces.T
        ab, bc, ca = middle.T
        faces = np.concatenate([np.stack(f, axis=1) for f in [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]])
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    random = np.random.default_rng(seed)
    for direction in random.normal(size=(6, 3)):
        direction /= np.linalg.norm(direction)
        vertices *= (1 + 0.4 * np.exp(8 * (vertices @ direction / np.linalg.norm(vertices, axis=1) - 1)))[:, None]
    return vertices, faces


@pytest.fixture(scope="session")
def mesh():
    return sphere()
