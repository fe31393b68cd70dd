"""What the peers share: their options, measuring, and one JSON object a line.

A peer runs on what `cargo bench --workspace --bench NAME -- --export DIR` wrote, does the same work, and says whether it came
to the same result. The variable OMP_NUM_THREADS sets its threads.
"""

import argparse
import importlib
import json
import os
import pathlib
import sys
import time

#: Threads that a peer may use.
THREADS = int(os.environ.get("OMP_NUM_THREADS", os.cpu_count()))
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = str(THREADS)

import numpy as np  # noqa: E402  (reads the variables as it loads)


def options(description):
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=pathlib.Path, help="what --export of the bench wrote")
    parser.add_argument("--quick", action="store_true", help="one repetition")
    parser.add_argument("--largest", type=int, default=10**9, metavar="N", help="leave larger cases out")
    return parser.parse_args()


def package(name):
    """A package, or None with a message where it is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        print(f"skipped {name}: {error}", file=sys.stderr, flush=True)
        return None


def cases(folder, bench):
    """The folders of a bench's cases with their names split at the dashes, the smallest first."""
    found = [(path, path.name.split("-")[1:]) for path in folder.glob(f"{bench}-*")]
    return sorted(found, key=lambda case: [(not part.isdigit(), int(part) if part.isdigit() else 0) for part in case[1]])


def load(folder, name):
    return np.load(folder / f"{name}.npy")


def least(runs, work):
    """The cost of the run that took least time, and its result."""
    best, result = None, None
    for _ in range(runs):
        reset_peak_memory()
        start, cpu = time.perf_counter(), time.process_time()
        result = work()
        cost = {"seconds": time.perf_counter() - start, "cpu_seconds": time.process_time() - cpu, "peak_mb": peak_memory_mb()}
        if best is None or cost["seconds"] < best["seconds"]:
            best = cost
    return best, result


def tell(case, peer, cost, agreement, agrees, **figures):
    """Prints a figure: `agreement` says in words how far the results agree, `agrees` whether that is enough; both are None
    where nothing is to be compared."""
    figures = {"case": case, "peer": peer, "threads": THREADS, **cost, **figures}
    figures |= {"agreement": agreement, "agrees": None if agrees is None else bool(agrees)}
    print(json.dumps(figures), flush=True)


def same_targets(ours, theirs, squared_distance):
    """How far two lists of nearest rows agree; another row just as near, `squared_distance(queries, rows)`, is as good."""
    other = np.flatnonzero(ours != theirs)
    a, b = squared_distance(other, ours[other]), squared_distance(other, theirs[other])
    ties = np.abs(a - b) <= 1e-9 * np.maximum(a, b) + 1e-12
    wrong = int((~ties).sum())
    text = "all indices equal" if len(other) == 0 else f"{len(other)} of {len(ours)} indices differ, {len(other) - wrong} of them ties"
    return text, wrong == 0


def reset_peak_memory():
    """From here on the peak is counted anew, where Linux allows it; else it is that of the whole run so far."""
    try:
        pathlib.Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        pass


def peak_memory_mb():
    try:
        status = pathlib.Path("/proc/self/status").read_text()
    except OSError:
        return 0.0
    line = next(line for line in status.splitlines() if line.startswith("VmHWM"))
    return int(line.split()[1]) * 1024e-6
