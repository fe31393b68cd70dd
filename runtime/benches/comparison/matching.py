"""`fmnet-infer match` as a user runs it: cold, and with the shapes in a cache, over the number of vertices."""

import json
import os
import shutil

from . import stages

#: Pairs of up to so many vertices are matched several times, and the fastest counts.
REPEATED = 20_000
REPETITIONS = 3
#: Runs of a program that does nothing, of which the fastest counts.
STARTS = 20


def measure(run, name, folder):
    """A figure of each pair and state of the cache: seconds, CPU seconds, peak memory, seconds of every stage. Those of the
    bench that makes the pairs come first."""
    limits = ["--quick"] if run.quick else []
    figures = stages.bench(run, "mesh", str(run.cores), limits, folder)
    pairs = sorted(folder.glob("pair-*"), key=lambda path: int(path.name.split("-")[1]))
    if run.dry_run:
        pairs = [folder / "pair-N"]
    figures += [] if run.dry_run else start(run)
    for pair in pairs:
        n = 0 if run.dry_run else int(pair.name.split("-")[1])
        repetitions = 1 if run.quick or n > REPEATED else REPETITIONS
        cache = ["--cache", pair / "cache"]
        figures += matched(run, name, pair, n, "cold", [], repetitions)
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
    return [figure | cost | {"stages": stage_seconds(json.loads(output)["stages"])}]


def stage_seconds(stages):
    """Seconds of each stage. Source and target are processed side by side: of the two the slower one counts."""
    seconds = {}
    for record in stages:
        stage = record["stage"]
        seconds[stage] = max(seconds.get(stage, 0.0), record["seconds"])
    return seconds


def start(run):
    """Size and start-up of the program."""
    program = run.program("fmnet-infer")
    costs = [run.execute([program, "--version"])[1] for _ in range(1 if run.quick else STARTS)]
    costs = [cost for cost in costs if cost]
    if not costs:
        return []
    cost = min(costs, key=lambda cost: cost["seconds"])
    return [{"bench": "match", "case": "start", "bytes": os.path.getsize(program), "threads": 1, **cost}]
