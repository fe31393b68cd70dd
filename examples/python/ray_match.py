"""Matches the pairs of a list on many processes or machines, by Ray; the files are those of `fmnet-infer batch`.

    pip install ./python ray
    python examples/python/ray_match.py pairs.txt --out maps --workers 8

Every worker loads the model once, and every shape is described once, wherever it is needed. A map that is there is kept where both
meshes, the model and every option are the same as then, else made anew: either program goes on where the other was stopped.
A pair whose worker dies is run again, by the worker that takes its place. On a cluster that is up (`ray start`), the folders have to be shared by its machines.
"""

import argparse
import os
import sys
import time
import warnings
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import fmnet
import ray


@dataclass
class Outcome:
    """What became of a pair."""

    source: Path
    target: Path
    out: Path
    kept: bool = False
    error: str = ""
    warnings: tuple = ()
    worker: int = 0


class Worker:
    """A process with the model."""

    def __init__(self, options):
        self.matcher = fmnet.Matcher(**options)

    def describe(self, path):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            shape = self.matcher.describe(path)
        return shape, tuple(str(w.message) for w in caught)

    def match(self, source, target, out, key, partial):
        """Writes a map; a source or target is a described shape with its warnings, or a path."""
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            shapes = [side[0] if isinstance(side, tuple) else side for side in (source, target)]
            self.matcher.match(*shapes, partial=partial).save(out, key=key)
        told = [text for side in (source, target) if isinstance(side, tuple) for text in side[1]]
        return tuple(told) + tuple(str(w.message) for w in caught), os.getpid()


@ray.remote(num_cpus=1, max_retries=1)
def hash_of(path):
    """The hash of a mesh, or what is wrong with it."""
    try:
        return fmnet.mesh_hash(path), ""
    except (ValueError, OSError) as error:
        return None, str(error)


def match_pairs(pairs, options, workers, threads=1, partial=False):
    """Matches pairs of (source, target, out) and gives an Outcome for each, in the order in which they are done."""
    paths = sorted({path for source, target, _ in pairs for path in (source, target)})
    hashes = dict(zip(paths, ray.get([hash_of.remote(path) for path in paths])))
    matcher = fmnet.Matcher(**options)
    waiting = []
    for source, target, out in pairs:
        error = hashes[source][1] or hashes[target][1]
        key = None if error else matcher.map_key(hashes[source][0], hashes[target][0], partial=partial)
        if error or made_from(out) == key:
            yield Outcome(source, target, out, kept=not error, error=error)
        else:
            waiting.append((source, target, out, key))
    if waiting:
        yield from _share_out(waiting, options, min(workers, len(waiting)), threads, partial)


def made_from(out):
    """The key of a map that is there."""
    key = out.with_name(out.name + ".key")
    return key.read_text().strip() if out.is_file() and key.is_file() else None


def _share_out(waiting, options, workers, threads, partial):
    """One job at a time for each worker, so that one that dies takes no other job with it."""
    # Ray counts a call that finds no worker yet as a try, so that one death may take two. A pair that always ends its worker is given up.
    remote = ray.remote(num_cpus=threads, max_restarts=-1, max_task_retries=3)(Worker)
    environment = {"env_vars": {"RAYON_NUM_THREADS": str(threads)}}
    idle = [remote.options(runtime_env=environment).remote(options) for _ in range(workers)]
    jobs, running = _jobs(waiting, partial), {}
    while True:
        while idle:
            job = next(jobs, None)
            if job is None:
                break
            worker = idle.pop()
            running[job(worker)] = worker, job
        if not running:
            return
        (done, *_), _ = ray.wait(list(running), num_returns=1)
        worker, job = running.pop(done)
        idle.append(worker)
        if job.pair is not None:
            yield _outcome(job.pair, done)


def _outcome(pair, done):
    source, target, out, _ = pair
    try:
        told, worker = ray.get(done)
        return Outcome(source, target, out, warnings=told, worker=worker)
    except ray.exceptions.RayTaskError as error:
        return Outcome(source, target, out, error=str(error.cause))
    except ray.exceptions.RayError as error:
        return Outcome(source, target, out, error=f"{source} -> {target}: its worker died: {error}")


class _Job:
    """A call of a worker: with a pair, its match; without, the description of a shape."""

    def __init__(self, call, pair=None):
        self.call, self.pair = call, pair

    def __call__(self, worker):
        return self.call(worker)


def _jobs(waiting, partial):
    """Shapes just before the first pair that needs them; let go after the last."""
    uses = Counter(path for source, target, *_ in waiting for path in ([target] if partial else {source, target}))
    shapes = {}

    def described(path):
        def call(worker):
            shapes[path] = worker.describe.remote(path)
            return shapes[path]

        return _Job(call)

    def matched(pair):
        source, target, out, key = pair

        def call(worker):
            # A part is described in the unit of its whole, so for each pair anew.
            sides = [source if partial else shapes[source], shapes[target]]
            done = worker.match.remote(*sides, out, key, partial)
            for path in [target] if partial else {source, target}:
                uses[path] -= 1
                if uses[path] == 0:
                    del shapes[path]
            return done

        return _Job(call, pair)

    for pair in waiting:
        source, target, *_ = pair
        for path in [target] if partial else dict.fromkeys([source, target]):
            if path not in shapes:
                yield described(path)
        yield matched(pair)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("pairs", help="a pair of mesh files a line")
    parser.add_argument("--out", required=True, type=Path, help="folder for the maps")
    parser.add_argument("--root", help="folder that mesh files are relative to [default: that of the list]")
    parser.add_argument("--format", default="txt", choices=["txt", "vts", "npy", "csv", "npz"])
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="processes [default: the cores of this machine]")
    parser.add_argument("--threads", type=int, default=1, help="threads of each [default: 1]")
    parser.add_argument("--partial", action="store_true", help="every source is a part of its target")
    parser.add_argument("--model")
    parser.add_argument("--descriptor", default="learned", choices=["learned", "shot"])
    parser.add_argument("-k", type=int)
    parser.add_argument("--fm")
    parser.add_argument("--refine")
    parser.add_argument("--decimate", type=lambda text: text if text == "off" else int(text))
    return parser.parse_args()


def main():
    given = arguments()
    names = ["model", "descriptor", "k", "fm", "refine", "decimate"]
    options = {name: getattr(given, name) for name in names}
    given.out.mkdir(parents=True, exist_ok=True)
    pairs = fmnet.read_pairs(given.pairs, given.out.absolute(), root=given.root, format=given.format)
    pairs = [(source.absolute(), target.absolute(), out) for source, target, out in pairs]
    address = os.environ.get("RAY_ADDRESS")
    ray.init(address=address, num_cpus=None if address else given.workers * given.threads, log_to_driver=False)
    start, done, kept, failed = time.perf_counter(), 0, 0, 0
    told = set()
    for outcome in match_pairs(pairs, options, given.workers, given.threads, given.partial):
        for text in outcome.warnings:
            # Of a shape, every one of its pairs has the warnings.
            if text not in told:
                told.add(text)
                print(f"warning: {text}", file=sys.stderr)
        if outcome.error:
            failed += 1
            print(f"warning: {outcome.error}", file=sys.stderr)
        elif outcome.kept:
            kept += 1
        else:
            done += 1
            seconds = time.perf_counter() - start
            print(f"{outcome.out}: {done} matched, {done / seconds:.2f} a second", file=sys.stderr)
    print(f"{done} matched, {kept} were there already, {failed} failed")
    return 2 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
