"""`fmnet-infer match` as a user runs it: cold, and with the shapes in a cache, over the number of vertices; and `batch`."""

import itertools
import json
import shutil

from . import stages

#: Pairs of up to so many vertices are matched several times, and the fastest counts.
REPEATED = 20_000
REPETITIONS = 3
#: Larger pairs are matched cold alone: their shapes fill a cache with gigabytes.
CACHED = 200_000


def measure(run, name, folder):
    """A figure of each pair and state of the cache: seconds, CPU seconds, peak memory, seconds of every stage. Those of the
    bench that makes the pairs come first."""
    limits = ["--quick"] if run.quick else []
    figures = stages.bench(run, "mesh", str(run.cores), limits, folder)
    pairs = sorted(folder.glob("pair-*"), key=lambda path: int(path.name.split("-")[1]))
    if run.dry_run:
        pairs = [folder / "pair-N"]
    for pair in pairs:
        n = 0 if run.dry_run else int(pair.name.split("-")[1])
        repetitions = 1 if run.quick or n > REPEATED else REPETITIONS
        cache = ["--cache", pair / "cache"]
        figures += matched(run, name, pair, n, "cold", [], repetitions)
        if n <= CACHED:
            # Fills the cache, and is not counted.
            matched(run, name, pair, n, "filling", cache, 1)
            figures += matched(run, name, pair, n, "cached", cache, repetitions)
        shutil.rmtree(pair, ignore_errors=True)
    return figures


def matched(run, name, pair, n, state, options, repetitions):
    command = [run.program("fmnet-infer"), "match", pair / "source.ply", pair / "target.ply", "-o", pair / "map.txt"]
    runs = [run.execute([*command, "--quiet", "--json", *options]) for _ in range(repetitions)]
    runs = [(output, cost) for output, cost in runs if output and cost]
    if not runs:
        return []
    output, cost = min(runs, key=lambda result: result[1]["seconds"])
    figure = {"bench": name, "case": f"match-{state}-{n}", "state": state, "vertices": n, "threads": run.cores}
    summary = json.loads(output)
    return [figure | cost | {"stages": stage_seconds(summary["stages"]), "ways": len(summary["candidates"])}]


def stage_seconds(stages):
    """Seconds of each stage. Source and target are processed side by side: of the two the slower one counts. What is done
    several times of one subject is added up."""
    seconds = {}
    for record in stages:
        subjects = seconds.setdefault(record["stage"], {})
        subjects[record["subject"]] = subjects.get(record["subject"], 0.0) + record["seconds"]
    return {stage: max(subjects.values()) for stage, subjects in seconds.items()}


def measure_batch(run, name, folder):
    """A figure for each number of threads: all pairs of some shapes, from files to maps, nothing cached before."""
    command = [run.program("mesh"), "--batch", "--export", folder, *(["--quick"] if run.quick else [])]
    run.execute(command, {})
    shapes = sorted((folder / "batch").glob("*.ply"))
    pairs = list(itertools.combinations([shape.name for shape in shapes], 2))
    listed = folder / "batch" / "pairs.txt"
    if not run.dry_run and pairs:
        listed.write_text("".join(f"{source} {target}\n" for source, target in pairs))
    figures = []
    for threads in sorted({1, run.cores}):
        out = folder / f"maps-{threads}"
        words = ["batch", listed, "--out", out, "--effort", "low", "--quiet", "--json", "--threads", threads]
        output, cost = run.execute([run.program("fmnet-infer"), *words])
        if output and cost:
            done = json.loads(output)["matched"]
            figure = {"bench": name, "case": "batch", "threads": threads, "shapes": len(shapes), "pairs": done}
            figures.append(figure | cost | {"pairs_per_second": done / cost["seconds"]})
    return figures
