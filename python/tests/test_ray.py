"""Pairs matched by Ray: the files of `batch`, also where a worker is killed in the middle."""

import os
import signal
import sys

import numpy as np
import pytest

from conftest import ROOT, sphere

ray = pytest.importorskip("ray")
sys.path.insert(0, str(ROOT / "examples" / "python"))
pytestmark = pytest.mark.filterwarnings("default")

# Ray's workers give way to everything else by default, and would wait for minutes on a busy machine.
os.environ.setdefault("RAY_worker_niceness", "0")

OPTIONS = dict(descriptor="shot", k=30)


@pytest.fixture(scope="module")
def cluster():
    # A script is known to its workers; a module has to be found by them.
    environment = {"env_vars": {"PYTHONPATH": str(ROOT / "examples" / "python")}}
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False, runtime_env=environment)
    yield
    ray.shutdown()


@pytest.fixture
def folder(tmp_path):
    """Five shapes, one of them broken, and a list of pairs."""
    for seed in range(4):
        vertices, faces = sphere(4, seed)
        lines = [f"OFF\n{len(vertices)} {len(faces)} 0"]
        lines += [" ".join(map(repr, v)) for v in vertices.tolist()]
        lines += [f"3 {a} {b} {c}" for a, b, c in faces.tolist()]
        (tmp_path / f"s{seed}.off").write_text("\n".join(lines) + "\n")
    (tmp_path / "bad.off").write_text("OFF\n3 1 0\n0 0 0\n")
    pairs = [f"s{a}.off s{b}.off" for a in range(4) for b in range(4) if a != b]
    (tmp_path / "pairs.txt").write_text("\n".join(pairs) + "\n")
    return tmp_path


def maps(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def match_all(folder, out, kill=False, partial=False):
    """All outcomes; with `kill`, the worker of the first pair is killed as soon as that is done."""
    import fmnet
    import ray_match

    out.mkdir(exist_ok=True)
    pairs = fmnet.read_pairs(folder / "pairs.txt", out)
    outcomes, times = [], {}
    for outcome in ray_match.match_pairs(pairs, OPTIONS, workers=2, partial=partial):
        outcomes.append(outcome)
        if outcome.out.is_file():
            times[outcome.out] = outcome.out.stat().st_mtime_ns
        if kill and len(outcomes) == 3:
            os.kill(outcome.worker, signal.SIGKILL)
    # What was done before the kill was not done again.
    assert all(path.stat().st_mtime_ns == time for path, time in times.items())
    return outcomes


def test_the_files_are_those_of_batch_and_each_goes_on_where_the_other_stopped(cluster, folder, program):
    words = ["--descriptor", "shot", "-k", 30]
    program("batch", folder / "pairs.txt", "--out", folder / "batch", *words)
    outcomes = match_all(folder, folder / "ray")
    assert len(outcomes) == 12 and not any(o.error or o.kept for o in outcomes)
    assert len({o.worker for o in outcomes}) == 2
    assert maps(folder / "ray") == maps(folder / "batch")
    # All are kept by either, until a mesh is another.
    assert all(o.kept for o in match_all(folder, folder / "batch"))
    vertices, _ = sphere(4, 3)
    text = (folder / "s0.off").read_text().split("\n")
    text[2] = " ".join(map(repr, (vertices[0] * 0.9).tolist()))
    (folder / "s0.off").write_text("\n".join(text))
    again = match_all(folder, folder / "ray")
    assert sorted(o.kept for o in again) == [False] * 6 + [True] * 6
    program("batch", folder / "pairs.txt", "--out", folder / "batch", *words)
    assert maps(folder / "ray") == maps(folder / "batch")


@pytest.mark.skipif(os.name == "nt", reason="no kill on Windows")
def test_a_killed_worker_costs_its_pair_once_more(cluster, folder, program):
    program("batch", folder / "pairs.txt", "--out", folder / "batch", "--descriptor", "shot", "-k", 30)
    outcomes = match_all(folder, folder / "ray", kill=True)
    assert [o.error for o in outcomes] == [""] * 12
    assert len({o.worker for o in outcomes}) == 3, "no worker took the killed one's place"
    assert len(outcomes) == len({o.out for o in outcomes}) == 12
    assert maps(folder / "ray") == maps(folder / "batch")


def test_parts_are_matched_as_by_batch(cluster, folder, program):
    program("batch", folder / "pairs.txt", "--out", folder / "batch", "--descriptor", "shot", "-k", 30, "--partial")
    assert not any(o.error for o in match_all(folder, folder / "ray", partial=True))
    assert maps(folder / "ray") == maps(folder / "batch")


def test_what_fails_is_said_and_the_rest_goes_on(cluster, folder):
    (folder / "pairs.txt").write_text("s0.off bad.off\ns0.off s1.off\n")
    bad, good = sorted(match_all(folder, folder / "ray"), key=lambda o: o.target.name)
    assert "bad.off, line" in bad.error and not bad.out.exists()
    assert not good.error and len(np.loadtxt(good.out)) == 2562
