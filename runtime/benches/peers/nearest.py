"""Times NumPy's brute force and SciPy's kd-tree on what `cargo bench --workspace --bench nearest -- --export DIR` wrote.

    OMP_NUM_THREADS=1 python benches/peers/nearest.py DIR
"""

import common
import numpy as np

#: A kd-tree in so many dimensions compares nearly all pairs, one after another: hours for 200K points.
LARGEST_TREE = 7000
#: Bytes of a block of the table of distances.
BLOCK_BYTES = 64e6


def brute_force(queries, targets):
    """For each query the nearest row, by one matrix product a block."""
    squares = np.einsum("ij,ij->i", targets, targets)
    rows = max(1, int(BLOCK_BYTES / 8 / len(targets)))
    index = np.empty(len(queries), dtype=np.int64)
    for first in range(0, len(queries), rows):
        table = queries[first : first + rows] @ targets.T
        table *= -2
        table += squares
        index[first : first + rows] = table.argmin(axis=1)
    return index


def main():
    arguments = common.options(__doc__)
    spatial = common.package("scipy.spatial")
    for folder, (n, _, _) in common.cases(arguments.folder, "nearest"):
        n = int(n)
        if n > arguments.largest:
            continue
        queries, targets, ours = (common.load(folder, name) for name in ("queries", "targets", "index"))

        def squared_distance(of_queries, of_rows):
            return ((queries[of_queries] - targets[of_rows]) ** 2).sum(axis=1)

        runs = 1 if arguments.quick or n > 50_000 else 3
        cost, index = common.least(runs, lambda: brute_force(queries, targets))
        common.tell(folder.name, "numpy brute force", cost, *common.same_targets(ours, index, squared_distance))
        if spatial is None or n > LARGEST_TREE:
            continue
        cost, index = common.least(
            1, lambda: spatial.cKDTree(targets).query(queries, workers=common.THREADS)[1]
        )
        common.tell(folder.name, "scipy cKDTree", cost, *common.same_targets(ours, index, squared_distance))


if __name__ == "__main__":
    main()
