"""Checks a model file with onnx's own checker and runs it: run_model.py MODEL.onnx FOLDER OUT.npy, with FOLDER/NAME.npy for each input."""

import sys
from pathlib import Path

import numpy as np
import onnx
import onnxruntime

model_path, folder, out_path = sys.argv[1:]
onnx.checker.check_model(onnx.load(model_path), full_check=True)
session = onnxruntime.InferenceSession(model_path, providers=["CPUExecutionProvider"])
inputs = {i.name: np.load(Path(folder) / f"{i.name}.npy") for i in session.get_inputs()}
(descriptors,) = session.run(["descriptors"], inputs)
np.save(out_path, descriptors)
