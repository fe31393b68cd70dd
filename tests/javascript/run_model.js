// Runs a model file on raw float32 rows of width 352: run_model.js MODEL.onnx SHOT.f32 DESCRIPTORS.f32
"use strict";
const fs = require("fs");
const { createRequire } = require("module");
const ort = createRequire(process.env.FMNET_NODE_FOLDER + "/package.json")("onnxruntime-node");

async function main() {
  const [model, shot, out] = process.argv.slice(2);
  const bytes = fs.readFileSync(shot);
  const values = new Float32Array(bytes.buffer, bytes.byteOffset, bytes.length / 4);
  const session = await ort.InferenceSession.create(model);
  const input = new ort.Tensor("float32", values, [values.length / 352, 352]);
  const { descriptors } = await session.run({ shot: input });
  fs.writeFileSync(out, Buffer.from(descriptors.data.buffer, descriptors.data.byteOffset, descriptors.data.byteLength));
}

main().catch(error => { console.error(error); process.exit(1); });
