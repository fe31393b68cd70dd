"""Checks a model file with onnx's own checker and runs it: run_model.py MODEL.onnx SHOT.npy DESCRIPTORS.npy"""

import sys

import numpy as np
import onnx
import onnxruntime

model_path, shot_path, out_path = sys.argv[1:]
onnx.checker.check_model(onnx.load(model_path), full_check=True)
session = onnxruntime.InferenceSession(model_path, providers=["CPUExecutionProvider"])
(descriptors,) = session.run(["descriptors"], {"shot": np.load(shot_path)})
np.save(out_path, descriptors)
