"""Times Python's onnxruntime on the descriptors that `cargo bench --bench network -- --export DIR` wrote.

    python benches/peers/network.py models/bodies/model.onnx DIR/shot.npy
"""

import sys
import time

import numpy as np
import onnxruntime


def main():
    model, descriptors = sys.argv[1], np.load(sys.argv[2])
    for threads in (1, 2):
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = threads
        session = onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])
        seconds = []
        for _ in range(5):
            start = time.perf_counter()
            session.run(None, {"shot": descriptors})
            seconds.append(time.perf_counter() - start)
        print(f"onnxruntime, {len(descriptors)} vertices, {threads} threads: {min(seconds):.3f} s")


if __name__ == "__main__":
    main()
