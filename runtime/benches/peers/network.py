"""Times Python's onnxruntime, on 1 and 2 threads, on what `cargo bench --workspace --bench network -- --export DIR` wrote.

    python benches/peers/network.py DIR
"""

import pathlib
import sys

import common
import numpy as np

#: The built-in model, as the bench loads it.
MODEL = pathlib.Path(__file__).resolve().parents[2] / "model.onnx"
#: What computed the outputs in the bench, with the difference relative to the largest output that counts as agreement: in single
#: precision tract comes to 1e-4 at 15000 vertices.
BACKENDS = {"native": 1e-4, "tract": 2e-4}


def main():
    arguments = common.options(__doc__)
    onnxruntime = common.package("onnxruntime")
    if onnxruntime is None:
        sys.exit(0)
    for folder, (n,) in common.cases(arguments.folder, "network"):
        names = [path.stem.removeprefix("input-") for path in folder.glob("input-*.npy")]
        inputs = {name: common.load(folder, f"input-{name}") for name in names}
        for threads in (1, 2):
            settings = onnxruntime.SessionOptions()
            settings.intra_op_num_threads = threads
            session = onnxruntime.InferenceSession(str(MODEL), settings, providers=["CPUExecutionProvider"])
            cost, (output,) = common.least(1 if arguments.quick else 5, lambda: session.run(None, inputs))
            for backend, tolerance in BACKENDS.items():
                difference = np.abs(output - common.load(folder, backend)).max() / np.abs(output).max()
                text = f"outputs within {difference:.0e}"
                cost |= {"threads": threads}
                common.tell(f"network-{backend}-{n}", "onnxruntime", cost, text, difference < tolerance)


if __name__ == "__main__":
    main()
