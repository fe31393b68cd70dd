"""Matches two meshes and draws both, each point in the colour of its match.

    pip install ./python matplotlib tqdm
    python examples/python/match_and_plot.py man.obj woman.glb pair.png
"""

import argparse

import matplotlib

matplotlib.use("Agg")  # Draws to a file; no display is needed.

import fmnet  # noqa: E402
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from tqdm import tqdm  # noqa: E402


def colors_of(vertices):
    """A colour for each place: red, green, blue by x, y, z; [n, 3]."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    return 0.15 + 0.8 * (vertices - low) / (high - low)


def broadside(vertices):
    """The turn [3, 3] after which a mesh is seen along the axis that it is thinnest in, with y or z of its file up."""
    thin = np.linalg.svd(vertices - vertices.mean(axis=0), full_matrices=False)[2][2]
    up = np.eye(3)[1 if abs(thin[1]) <= abs(thin[2]) + 0.1 else 2]
    across = np.cross(up, thin)
    across /= np.linalg.norm(across)
    return np.array([across, np.cross(thin, across), thin])


def facing_as(points, matches):
    """The turn [3, 3] of points [n, 3] that is nearest to their matches [n, 3]: files differ in which axis is up."""
    u, _, vt = np.linalg.svd((matches - matches.mean(axis=0)).T @ (points - points.mean(axis=0)))
    return u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt


def draw(axes, vertices, faces, colors, title):
    """Draws a mesh of coloured triangles, seen from the front (z towards the viewer, y up)."""
    x, y, z = vertices[:, 0], -vertices[:, 2], vertices[:, 1]
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    normals = np.cross(b - a, c - a)
    facing = np.abs(normals[:, 2]) / np.maximum(np.linalg.norm(normals, axis=1), 1e-30)
    drawing = axes.plot_trisurf(x, y, z, triangles=faces, shade=False)
    drawing.set_facecolor(colors[faces].mean(axis=1) * (0.4 + 0.6 * facing)[:, None])
    axes.set_title(title)
    axes.set_box_aspect(np.ptp([x, y, z], axis=1), zoom=1.0)
    axes.set_axis_off()
    axes.view_init(elev=0, azim=-90)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("source")
    parser.add_argument("target")
    parser.add_argument("out", help="picture, .png or .pdf")
    arguments = parser.parse_args()

    matcher = fmnet.Matcher(decimate="off", subdivide="off")
    with tqdm(desc="stages", unit=" stages") as bar:

        def progress(subject, stage, seconds):
            bar.set_postfix_str(f"{subject}: {stage}")
            bar.update(seconds is not None)

        source = matcher.describe(arguments.source, progress=progress)
        target = matcher.describe(arguments.target, progress=progress)
        match = matcher.match(source, target, progress=progress)

    # Maps are in the vertices of the files; the shapes that are drawn may have lost some in repair.
    colors = np.full((match.n_target, 3), 0.5)
    colors[target.input_vertices] = colors_of(target.vertices)
    matched = match.targets[source.input_vertices]
    source_colors = np.where((matched >= 0)[:, None], colors[matched], 0.5)

    place = np.zeros((match.n_target, 3))
    place[target.input_vertices] = target.vertices
    turn = broadside(target.vertices)
    source_turn = turn @ facing_as(source.vertices[matched >= 0], place[matched[matched >= 0]])

    figure, axes = plt.subplots(1, 2, figsize=(8, 4.5), subplot_kw={"projection": "3d"})
    draw(axes[0], source.vertices @ source_turn.T, source.faces, source_colors, source.name)
    draw(axes[1], target.vertices @ turn.T, target.faces, colors[target.input_vertices], target.name)
    figure.subplots_adjust(left=0, right=1, bottom=0, top=0.92, wspace=0)
    figure.savefig(arguments.out, dpi=150)
    print(f"{(match.targets >= 0).sum()} of {match.n_source} vertices matched; {arguments.out} written")


if __name__ == "__main__":
    main()
