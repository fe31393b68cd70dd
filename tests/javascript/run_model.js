// Runs a model file: run_model.js MODEL.onnx FOLDER VERTICES OUT.f32, with raw float32 FOLDER/NAME.f32 for each input.
"use strict";
const fs = require("fs");
const path = require("path");
const { createRequire } = require("module");
const ort = createRequire(process.env.FMNET_NODE_FOLDER + "/package.json")("onnxruntime-node");

async function main() {
  const [model, folder, vertices, out] = process.argv.slice(2);
  const session = await ort.InferenceSession.create(model);
  const inputs = {};
  for (const name of session.inputNames) {
    const bytes = fs.readFileSync(path.join(folder, name + ".f32"));
    const values = new Float32Array(bytes.buffer, bytes.byteOffset, bytes.length / 4);
    const flat = name === "mass" || name === "eigenvalues";
    inputs[name] = new ort.Tensor("float32", values, flat ? [values.length] : [+vertices, values.length / vertices]);
  }
  const { descriptors } = await session.run(inputs);
  fs.writeFileSync(out, Buffer.from(descriptors.data.buffer, descriptors.data.byteOffset, descriptors.data.byteLength));
}

main().catch(error => { console.error(error); process.exit(1); });
