"""The stages: which bench measures each, which peer beside it, on how many threads."""

import dataclasses
import json
from typing import Optional


@dataclasses.dataclass(frozen=True)
class Stage:
    """A bench in Rust and, where there is one on PyPI, its peer in benches/peers, both called by the stage's name."""

    title: str
    about: str
    peer: bool
    #: The largest case that is also measured on one thread alone; 0 where the bench sets the threads itself.
    one_thread: int
    #: Larger cases take minutes and say nothing new.
    largest: Optional[int] = None

    @property
    def exports(self):
        """Whether something else goes on with what the bench wrote: the peer, or `fmnet-infer match`."""
        return self.peer or self is BENCHES["mesh"]


BENCHES = {
    "mesh": Stage(
        "Files, repair, decimation", "Generated people; decimation is to 15000 vertices. No peer.", False, 0,
    ),
    "eigen": Stage(
        "Eigenbasis",
        "The smallest eigenpairs of the cotangent Laplacian of a bumpy torus, against ARPACK with SuperLU in shift-invert mode. "
        "The assembly of the matrices is not counted.",
        True, 20_000,
    ),
    "shot": Stage(
        "SHOT", "352 bins at the default radius of 0.067 sqrt(area), so that the neighbours of a vertex grow with their number. "
        "No peer on PyPI.", False, 20_000,
    ),
    "network": Stage(
        "Descriptor network",
        "The built-in model on generated people, by the library's own kernels (`--backend native`) and by tract, against "
        "onnxruntime on the same file and inputs. Computing the inputs is not counted.",
        True, 0,
    ),
    "nearest": Stage(
        "Nearest neighbours",
        "Exact nearest rows of two spectral embeddings, as a point map needs them, without noise and with as much noise as signal. "
        "The k-d tree is measured on small cases alone: in so many dimensions it compares nearly all pairs. The brute force on 200K "
        "points answers a tenth of the queries, and its seconds are multiplied by ten.",
        True, 20_000,
    ),
    "fmap": Stage(
        "Functional map, point map, refinement",
        "Two generated people of 6890 vertices, described by the built-in model: the functional map of k eigenfunctions by least "
        "squares and with the resolvent mask; the point map at k = 100; ZoomOut from 60 to 200 eigenfunctions in steps of 20, one way as "
        "in its paper and in pyFM. The wavelet filter, with which `match` refines the maps of both directions, is set beside pyFM's "
        "ZoomOut of one direction. pyFM's own fit of a functional map minimises another energy and is not compared.",
        True, 20_000,
    ),
    "geodesic": Stage(
        "Geodesic distances",
        "One thread. Exact: one source, the fastest of several. All pairs: seconds of building the solver, and of one source times the "
        "number of vertices, against approximate methods, whose mean error relative to the exact distances is told.",
        True, 0, largest=20_000,
    ),
    "upscale": Stage(
        "Upscaling by functional maps",
        "What `--upscale l21` and `--upscale least-squares` do; the default's seconds are those of the stage `surface points` above. A "
        "body subdivided twice and a bent copy, decimated, 30 % of the matches wrong. No peer.",
        False, 0,
    ),
    "step": Stage(
        "Training step",
        "One pair, the fastest of several steps. The DiffusionNet, 4 blocks of width 128 and 128 eigenfunctions, sees all vertices of "
        "both shapes; functional maps of both directions, spectral loss and InfoNCE; the peer starts from the same weights. The paper's "
        "network, 7 blocks of width 352, sees points; its soft error needs a layer that the peer does not have.",
        True, 0,
    ),
}  # fmt: skip

#: What can be asked for, in the order of the page; the shapes that are matched come from the bench "mesh".
NAMES = ("match", "batch", "size", *(name for name in BENCHES if name != "mesh"))


def measure(run, name, folder):
    """Figures of the bench and of its peer."""
    stage = BENCHES[name]
    plan = [(str(run.cores), stage.largest)]
    if stage.one_thread and run.cores > 1:
        plan.insert(0, ("1", stage.one_thread))
    if name == "shot" and run.quick:
        plan = plan[:1]
    figures = []
    for threads, largest in plan:
        limits = ["--quick"] if run.quick else []
        limits += ["--largest", str(largest)] if largest else []
        figures += bench(run, name, threads, limits, folder)
        if stage.peer and run.python:
            figures += peer(run, name, threads, limits, folder)
    return figures


def bench(run, name, threads, limits, folder):
    command = [run.program(name), "--json", *limits, *(["--export", folder] if BENCHES[name].exports else [])]
    variables = {"RAYON_NUM_THREADS": threads}
    # Files that are at hand on some machines would make the pages of two machines differ.
    output, _ = run.execute(command, variables | {"FMNET_DATA": "none"})
    return [json.loads(line) for line in output.splitlines()]


def peer(run, name, threads, limits, folder):
    script = f"runtime/benches/peers/{name}.py"
    variables = {"OMP_NUM_THREADS": threads, "OPENBLAS_NUM_THREADS": threads}
    output, _ = run.execute([run.python, script, folder, *limits], variables)
    return [{"bench": name, **json.loads(line)} for line in output.splitlines()]
