"""Times NumPy's brute force and SciPy's kd-tree on what `cargo bench --workspace --bench nearest -- --export DIR` wrote.

    OMP_NUM_THREADS=1 python benches/peers/nearest.py DIR
"""

import common
import numpy as np

#: A kd-tree in so many dimensions compares nearly all pairs, one after another: hours for 200K points.
LARGEST_TREE = 7000
#: Above so many queries the brute force, whose time is proportional to their number, answers every tenth.
LARGEST_WHOLE = 50_000
#: Queries and targets of a block: of those tried the fastest.
BLOCK = (400, 20_000)


def brute_force(queries, targets):
    """For each query the nearest row: the least of |t|^2 - 2 q.t, by matrix products of blocks that stay in the cache."""
    squares = np.einsum("ij,ij->i", targets, targets)
    lifted = np.column_stack([-2 * targets, squares]).T
    index = np.empty(len(queries), dtype=np.int64)
    for first in range(0, len(queries), BLOCK[0]):
        block = queries[first : first + BLOCK[0]]
        block = np.column_stack([block, np.ones(len(block))])
        least, rows = np.full(len(block), np.inf), np.arange(len(block))
        for start in range(0, len(targets), BLOCK[1]):
            table = block @ lifted[:, start : start + BLOCK[1]]
            at = table.argmin(axis=1)
            nearer = table[rows, at] < least
            least[nearer] = table[rows, at][nearer]
            index[first : first + len(block)][nearer] = start + at[nearer]
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

        step = 10 if n > LARGEST_WHOLE else 1
        sample = queries[::step]
        cost, index = common.least(
            1 if arguments.quick or step > 1 else 3, lambda: brute_force(sample, targets)
        )
        cost |= {name: step * cost[name] for name in ("seconds", "cpu_seconds")}
        text, agrees = common.same_targets(
            ours[::step], index, lambda at, rows: squared_distance(at * step, rows)
        )
        name = "numpy brute force" + (", ten times a tenth" if step > 1 else "")
        common.tell(folder.name, name, cost, text, agrees)
        if spatial is None or n > LARGEST_TREE:
            continue
        cost, index = common.least(
            1, lambda: spatial.cKDTree(targets).query(queries, workers=common.THREADS)[1]
        )
        common.tell(folder.name, "scipy cKDTree", cost, *common.same_targets(ours, index, squared_distance))


if __name__ == "__main__":
    main()
