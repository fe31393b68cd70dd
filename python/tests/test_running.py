"""While it runs: progress, Ctrl-C, threads, forked processes, types, docstrings, the time of the import."""

import inspect
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time

import fmnet
import numpy as np
import pytest

from conftest import sphere

SHOT = dict(descriptor="shot", k=40, shot_radius=0.2, subdivide="off")


def test_progress_tells_where_stages_begin_and_end(mesh):
    events = []
    fmnet.match(mesh, mesh, progress=lambda *event: events.append(event), **SHOT)
    began = [event[:2] for event in events if event[2] is None]
    ended = [event[:2] for event in events if event[2] is not None]
    assert sorted(began) == sorted(ended)
    assert ("source", "shot") in ended and ("source -> target", "functional map") in ended
    assert all(seconds >= 0 for _, _, seconds in events if seconds is not None)


def test_an_error_of_the_callback_ends_the_call(mesh):
    def stop(subject, stage, seconds):
        if stage == "shot":
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        fmnet.match(mesh, mesh, progress=stop, **SHOT)
    # What goes on in the background is no hindrance.
    fmnet.match(mesh, mesh, **SHOT)


@pytest.mark.skipif(os.name == "nt", reason="no kill on Windows")
def test_ctrl_c_works_within_a_fifth_of_a_second():
    large = sphere(6)
    sent = []

    def press():
        sent.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    # A shell that starts this in the background has it ignore Ctrl-C.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    # All distances of 40962 vertices from 4000 sources take many seconds.
    timer = threading.Timer(0.5, press)
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            fmnet.geodesic_distances(large, np.arange(4000))
        assert time.perf_counter() - sent[0] < 0.2
    finally:
        signal.signal(signal.SIGINT, before)


def test_other_threads_of_python_go_on():
    large, ticks, done = sphere(5), [], threading.Event()

    def tick():
        while not done.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.005)

    thread = threading.Thread(target=tick)
    thread.start()
    start = time.perf_counter()
    fmnet.shot(large, radius=0.1)
    seconds = time.perf_counter() - start
    done.set()
    thread.join()
    during = [t for t in ticks if start < t < start + seconds]
    assert len(during) > seconds / 0.1, "the interpreter's lock was held"


def shot_of(seed):
    return fmnet.shot(sphere(2, seed), radius=0.3)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_process_works_as_well():
    expected = [shot_of(seed) for seed in range(3)]
    with multiprocessing.get_context("fork").Pool(2) as pool:
        found = pool.map_async(shot_of, range(3)).get(timeout=60)
    for a, b in zip(expected, found):
        np.testing.assert_array_equal(a, b)


def test_the_same_bytes_whatever_the_threads(mesh, tmp_path):
    script = (
        "import fmnet, numpy as np, sys; m = np.load(sys.argv[1]);"
        "fmnet.match((m['v'], m['f']), (m['v'][::-1], len(m['v']) - 1 - m['f']), k=20).save(sys.argv[2])"
    )
    np.savez(tmp_path / "mesh.npz", v=mesh[0], f=mesh[1])
    maps = []
    for threads in ["1", "3"]:
        out = tmp_path / f"{threads}.csv"
        environment = {**os.environ, "RAYON_NUM_THREADS": threads, "PYTHONWARNINGS": "ignore"}
        subprocess.run([sys.executable, "-c", script, tmp_path / "mesh.npz", out], check=True, env=environment)
        maps.append(out.read_bytes())
    assert maps[0] == maps[1]


def test_everything_has_a_docstring_and_a_signature():
    for name in fmnet.__all__:
        public = getattr(fmnet, name)
        assert public.__doc__, name
        if inspect.isroutine(public):
            assert inspect.signature(public).parameters, name
            for section in ["Parameters\n----------", "Returns\n-------"]:
                assert section in public.__doc__, (name, section)
    for kind in [fmnet.Matcher, fmnet.Shape, fmnet.Match, fmnet.Evaluation]:
        for name, member in vars(kind).items():
            assert name.startswith("_") or member.__doc__, (kind, name)


def test_the_import_is_quick_and_takes_no_numpy():
    script = "import time; t = time.perf_counter(); import fmnet; print(time.perf_counter() - t)"
    script += "; import sys; assert 'numpy' not in sys.modules"
    runs = [subprocess.run([sys.executable, "-c", script], check=True, capture_output=True) for _ in range(5)]
    seconds = min(float(run.stdout) for run in runs)
    assert seconds < 0.1, f"{seconds} s"


def test_the_stubs_are_those_of_the_module():
    stubtest = [sys.executable, "-m", "mypy.stubtest", "fmnet", "--ignore-missing-stub", "--concise"]
    if subprocess.run([sys.executable, "-c", "import mypy"], capture_output=True).returncode != 0:
        pytest.skip("no mypy here")
    done = subprocess.run(stubtest, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
