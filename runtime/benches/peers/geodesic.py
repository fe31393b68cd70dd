"""Times pygeodesic and potpourri3d on what `cargo bench --workspace --bench geodesic -- --export DIR` wrote.

    python benches/peers/geodesic.py DIR

pygeodesic is exact (Mitchell, Mount and Papadimitriou, as Kirsanov wrote it); potpourri3d's heat method (Crane et al.) and fast
marching (Kimmel and Sethian) are approximations, whose error is told. All run on one thread.
"""

import common
import numpy as np

#: Relative difference of exact distances that counts as agreement.
TOLERANCE = 1e-6


def mean_error(distances, exact):
    reached = exact > 0
    return (np.abs(distances - exact)[reached] / exact[reached]).mean()


def exact(folder, vertices, faces, sources, ours):
    """Distances of our exact search, checked against pygeodesic's where that is installed."""
    pygeodesic = common.package("pygeodesic.geodesic")
    if pygeodesic is None:
        return
    solver = pygeodesic.PyGeodesicAlgorithmExact(vertices, faces)
    seconds, worst = [], 0.0
    for source, row in zip(sources, ours):
        cost, (distances, _) = common.least(1, lambda: solver.geodesicDistances(np.array([source]), None))
        seconds.append(cost)
        reached = row > 0
        worst = max(worst, (np.abs(distances - row)[reached] / row[reached]).max())
    cost = min(seconds, key=lambda cost: cost["seconds"])
    text = f"distances within {worst:.0e}"
    common.tell(f"{folder.name}-exact", "pygeodesic, exact", cost | {"threads": 1}, text, worst < TOLERANCE)


def approximate(name, make, folder, vertices, faces, sources, exact_rows, ours_error):
    """Seconds of all pairs, from those of building the solver and of one source."""
    build, solver = common.least(1, lambda: make(vertices, faces))
    costs, errors = [], []
    for source, row in zip(sources, exact_rows):
        cost, distances = common.least(1, lambda: solver(int(source)))
        costs.append(cost["seconds"])
        errors.append(mean_error(distances, row))
    all_pairs = build["seconds"] + min(costs) * len(vertices)
    text = f"mean error {100 * np.mean(errors):.2f} %, ours {100 * ours_error:.3f} %"
    cost = {"seconds": all_pairs, "source_seconds": min(costs), "threads": 1, "peak_mb": build["peak_mb"]}
    common.tell(f"{folder.name}-all-pairs", name, cost, text, None, mean_error=float(np.mean(errors)))


def main():
    arguments = common.options(__doc__)
    potpourri3d = common.package("potpourri3d")
    for folder, (*_, n) in common.cases(arguments.folder, "geodesic"):
        if int(n) > arguments.largest:
            continue
        vertices, faces, sources, ours, fast = (
            common.load(folder, name) for name in ("vertices", "faces", "sources", "exact", "solver")
        )
        exact(folder, vertices, faces, sources, ours)
        if potpourri3d is None:
            continue
        ours_error = mean_error(fast, ours)
        heat = lambda v, f: potpourri3d.MeshHeatMethodDistanceSolver(v, f).compute_distance
        march = lambda v, f: lambda s, march=potpourri3d.MeshFastMarchingDistanceSolver(v, f): march.compute_distance(
            [[(s, [])]]
        )
        for name, make in (("potpourri3d, heat method", heat), ("potpourri3d, fast marching", march)):
            approximate(name, make, folder, vertices, faces, sources, ours, ours_error)


if __name__ == "__main__":
    main()
