"""How large the things are that users fetch, and how fast the programs start."""

import importlib.util
import pathlib
import sys

#: Runs of a program that does nothing, of which the fastest counts.
STARTS = 20
#: Prints the seconds of the import alone, or fails.
IMPORT = "import time; start = time.perf_counter(); import fmnet; print(time.perf_counter() - start)"


def measure(run, name, folder):
    """A figure for each: the programs, the newest wheel and the page, where these were built."""
    if run.dry_run:
        return []
    figures = [program(run, name, case) for case in ("fmnet-infer", "fmnet-train")]
    wheels = sorted((run.root / "target" / "wheels").glob("fmnet-*.whl"), key=lambda path: path.stat().st_mtime)
    if wheels:
        figures.append({"bench": name, "case": "wheel", "bytes": wheels[-1].stat().st_size, "threads": 1} | imported(run))
    else:
        run.skip("the wheel: none was built into target/wheels (maturin build --release in python)")
    page = run.root / "web" / "dist"
    files = [file for file in page.iterdir() if file.is_file()] if page.is_dir() else []
    if files:
        figures.append({"bench": name, "case": "page", "bytes": sum(file.stat().st_size for file in files), "threads": 1})
    else:
        run.skip("the page: it was not built (web/build.sh)")
    return figures


def program(run, name, case):
    """Size and seconds to start."""
    path = run.program(case)
    costs = [run.execute([path, "--version"])[1] for _ in range(1 if run.quick else STARTS)]
    seconds = min((cost["seconds"] for cost in costs if cost), default=None)
    return {"bench": name, "case": case, "bytes": pathlib.Path(path).stat().st_size, "threads": 1, "seconds": seconds}


def imported(run):
    """Seconds of `import fmnet`, where the package is installed beside the peers."""
    if importlib.util.find_spec("fmnet") is None:
        return {}
    outputs = [run.execute([sys.executable, "-c", IMPORT])[0] for _ in range(1 if run.quick else 5)]
    seconds = [float(output) for output in outputs if output]
    return {"seconds": min(seconds)} if seconds else {}
