"""Times Python's onnxruntime, on 1 and 2 threads, on what `cargo bench --workspace --bench network -- --export DIR` wrote.

    python benches/peers/network.py DIR
"""

import pathlib
import sys

import common
import numpy as np

#: Difference relative to the largest output that counts as agreement.
TOLERANCE = 1e-4
MODEL = pathlib.Path(__file__).resolve().parents[3] / "models/bodies/model.onnx"


def main():
    arguments = common.options(__doc__)
    onnxruntime = common.package("onnxruntime")
    if onnxruntime is None:
        sys.exit(0)
    for folder, _ in common.cases(arguments.folder, "network"):
        shot, ours = common.load(folder, "shot"), common.load(folder, "descriptors")
        for threads in (1, 2):
            settings = onnxruntime.SessionOptions()
            settings.intra_op_num_threads = threads
            session = onnxruntime.InferenceSession(str(MODEL), settings, providers=["CPUExecutionProvider"])
            cost, (output,) = common.least(1 if arguments.quick else 5, lambda: session.run(None, {"shot": shot}))
            difference = np.abs(output - ours).max() / np.abs(output).max()
            text = f"outputs within {difference:.0e}"
            common.tell(folder.name, "onnxruntime", cost | {"threads": threads}, text, difference < TOLERANCE)


if __name__ == "__main__":
    main()
