"""Evaluates fmnet on a dataset, beside pyFM where that is installed.

    pip install ./python pyfmaps
    python examples/python/compare_pyfm.py registrations --pairs 8

The folder has meshes of one numbering, such as the FAUST registrations: vertex i of one corresponds with vertex i of the other.
pyFM (1.3 or newer) is run as its tutorial does: wave kernel signatures with 5 landmarks, its fit, ICP, ZoomOut. The landmarks are taken
from the ground truth, which fmnet is not given.
"""

import argparse
import time
from pathlib import Path

import fmnet
import numpy as np

try:
    from pyFM.functional import FunctionalMapping
    from pyFM.mesh import TriMesh
except ImportError:
    TriMesh = None


def by_fmnet(matcher, source, target):
    return matcher.match(source, target).targets


def by_pyfm(source, target):
    """pyFM gives for each vertex of its second mesh one of its first."""
    meshes = [TriMesh.load(str(path), area_normalize=True) for path in (target, source)]
    model = FunctionalMapping(*meshes)
    landmarks = np.linspace(0, len(meshes[0].vertices) - 1, 5).astype(int)
    model.preprocess(n_descr=100, descr_type="WKS", subsample_step=5, landmarks=landmarks, k_process=150)
    model.fit(K=(50, 50), w_descr=1e0, w_lap=1e-2, w_dcomm=1e-1, w_orient=0)
    functional_map = model.zoomout_refine(model.icp_refine(), nit=15, step=5)
    return model.get_p2p(functional_map)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder")
    parser.add_argument("--pairs", type=int, default=8)
    arguments = parser.parse_args()

    meshes = sorted(p for p in Path(arguments.folder).iterdir() if p.suffix.lower() in {".ply", ".obj", ".off"})
    pairs = [(a, b) for a in meshes for b in meshes if a != b]
    chosen = np.random.default_rng(1).permutation(len(pairs))[: arguments.pairs]
    matcher = fmnet.Matcher()
    methods = {"fmnet": lambda a, b: by_fmnet(matcher, a, b)}
    if TriMesh is None:
        print("pyFM is not installed (pip install pyfmaps) and is left out")
    else:
        methods["pyFM"] = by_pyfm
    print(f"{'method':8} {'mean x 100':>10} {'median':>8} {'above 5':>8} {'seconds a pair':>15}")
    for name, method in methods.items():
        errors, start = [], time.perf_counter()
        for source, target in (pairs[i] for i in chosen):
            targets = method(source, target)
            errors.append(100 * fmnet.evaluate(targets, np.arange(len(targets)), target).mean)
        seconds = (time.perf_counter() - start) / len(errors)
        print(f"{name:8} {np.mean(errors):10.2f} {np.median(errors):8.2f} {np.mean(np.array(errors) > 5):8.0%} {seconds:15.2f}")


if __name__ == "__main__":
    main()
