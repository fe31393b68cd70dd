// Matches two meshes with a model of fmnet, in plain JavaScript and onnxruntime-node.
//
//     fmnet-infer features a.ply --out a --model model.onnx
//     fmnet-infer features b.ply --out b --model model.onnx
//     npm install --ignore-scripts --prefix examples/javascript
//     node examples/javascript/match.js a b model.onnx map.txt
//
// The scripts of onnxruntime-node would fetch libraries for GPUs, which are not needed.
//
// Line i of map.txt is the vertex of b.ply that matches vertex i of a.ply, but for ties the map of `fmnet-infer match
// --refine none`. Where the mesh was repaired or decimated, `features` also writes vertices.npy, and a line belongs to the
// vertex that is named there.
"use strict";
const fs = require("fs");
const path = require("path");
const ort = require("onnxruntime-node");

/** A .npy file as { data, rows, cols }; a vector has one column. */
function readNpy(file) {
  const bytes = fs.readFileSync(file);
  const start = 10 + bytes.readUInt16LE(8);
  const header = bytes.toString("latin1", 10, start);
  const kinds = { "<f8": Float64Array, "<f4": Float32Array, "<i4": Int32Array };
  const Kind = kinds[/'descr': '(...)'/.exec(header)[1]];
  const [rows, cols = 1] = /'shape': \(([^)]*)\)/.exec(header)[1].split(",").filter(s => s.trim()).map(Number);
  return { data: new Kind(bytes.buffer.slice(bytes.byteOffset + start, bytes.byteOffset + bytes.length)), rows, cols };
}

/** The model's metadata_props, field 14 of ONNX's protocol buffer: what the network expects of its input and of the map. */
function readMetadata(file) {
  const metadata = {};
  forEachField(fs.readFileSync(file), (field, bytes) => {
    if (field !== 14) return;
    const entry = [];
    forEachField(bytes, (part, text) => { entry[part] = text.toString(); });
    metadata[entry[1]] = entry[2];
  });
  return metadata;
}

function forEachField(bytes, visit) {
  let at = 0;
  const varint = () => {
    for (let value = 0, scale = 1; ; scale *= 128) {
      value += (bytes[at] & 127) * scale;
      if (bytes[at++] < 128) return value;
    }
  };
  while (at < bytes.length) {
    const key = varint(), kind = key % 8;
    const length = kind === 2 ? varint() : { 1: 8, 5: 4 }[kind];
    if (length === undefined) { varint(); continue; }
    visit(Math.floor(key / 8), bytes.subarray(at, at += length));
  }
}

/** The first columns of a matrix, or entries of a vector, in single precision. */
function asInput({ data, rows, cols }, width) {
  if (cols === 1) return { values: Float32Array.from(data.subarray(0, width)), dims: [Math.min(width, rows)] };
  const values = new Float32Array(rows * width);
  for (let i = 0; i < rows; i++) values.set(data.subarray(i * cols, i * cols + width), i * width);
  return { values, dims: [rows, width] };
}

/** The eigenbasis [n, k] of a shape at unit area, and the Fourier coefficients [k, d] of its learned descriptors. */
async function readShape(folder, session, k) {
  const read = name => readNpy(path.join(folder, name + ".npy"));
  const inputs = {};
  for (const { name, shape } of session.inputMetadata) {
    const array = read(name), last = shape[shape.length - 1];
    const { values, dims } = asInput(array, typeof last === "number" && last > 0 ? last : array.rows);
    inputs[name] = new ort.Tensor("float32", values, dims);
  }
  const { descriptors } = await session.run(inputs);
  const mass = read("mass").data, vectors = read("eigenvectors"), n = mass.length, d = descriptors.dims[1];
  const phi = new Float64Array(n * k);
  const coefficients = Array.from({ length: k }, () => new Float64Array(d));
  for (let i = 0; i < n; i++) {
    for (let j = 0; j < k; j++) {
      phi[i * k + j] = vectors.data[i * vectors.cols + j];
      const weight = phi[i * k + j] * mass[i];
      for (let q = 0; q < d; q++) coefficients[j][q] += weight * descriptors.data[i * d + q];
    }
  }
  const renumbered = fs.existsSync(path.join(folder, "vertices.npy")) ? read("vertices").data : null;
  return { n, k, phi, coefficients, eigenvalues: read("eigenvalues").data.subarray(0, k), renumbered };
}

const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);

/** How little each entry [k_target, k_source] of a map that commutes with the Laplacians is used (Ren et al. 2019). */
function resolventMask(source, target) {
  const largest = Math.max(...source.eigenvalues, ...target.eigenvalues);
  const resolvent = eigenvalue => {
    const g = Math.sqrt(Math.max(eigenvalue, 0) / largest);
    return [g / (g * g + 1), 1 / (g * g + 1)];
  };
  const columns = Array.from(source.eigenvalues, resolvent);
  return Array.from(target.eigenvalues, resolvent)
    .map(([re, im]) => columns.map(([re2, im2]) => (re - re2) ** 2 + (im - im2) ** 2));
}

/** Solves S x = b for a symmetric positive definite S by its Cholesky factor. */
function solve(S, b) {
  const k = b.length, L = S.map(row => Float64Array.from(row)), x = Float64Array.from(b);
  for (let i = 0; i < k; i++) {
    for (let j = 0; j <= i; j++) {
      let sum = L[i][j];
      for (let m = 0; m < j; m++) sum -= L[i][m] * L[j][m];
      L[i][j] = i === j ? Math.sqrt(sum) : sum / L[j][j];
    }
    for (let m = 0; m < i; m++) x[i] -= L[i][m] * x[m];
    x[i] /= L[i][i];
  }
  for (let i = k - 1; i >= 0; i--) {
    for (let m = i + 1; m < k; m++) x[i] -= L[m][i] * x[m];
    x[i] /= L[i][i];
  }
  return x;
}

/** Rows of C [k_target, k_source] with C F = G: each row has a system of its own, (F F^T + weight diag(mask_i)) c_i = F g_i. */
function functionalMap(source, target, maskWeight) {
  const F = source.coefficients, mask = resolventMask(source, target);
  const gram = F.map(a => F.map(b => dot(a, b)));
  const weight = maskWeight * gram.reduce((sum, row, i) => sum + row[i], 0) / source.k;
  return target.coefficients.map((g, i) => {
    const system = gram.map((row, a) => row.map((x, b) => a === b ? x + weight * mask[i][a] : x));
    return solve(system, F.map(f => dot(f, g)));
  });
}

/** Each row of a [n, k], as rows of k_new, times the matrix whose rows are given. */
function transported(a, n, k, rows) {
  return Array.from({ length: n }, (_, i) => Float64Array.from(rows, row => dot(row, a.subarray(i * k, (i + 1) * k))));
}

/** For each query the nearest row. */
function nearest(queries, rows) {
  return queries.map(query => {
    let best = 0, smallest = Infinity;
    for (let y = 0; y < rows.length; y++) {
      let distance = 0;
      for (let j = 0; j < query.length && distance < smallest; j++) distance += (query[j] - rows[y][j]) ** 2;
      if (distance < smallest) [best, smallest] = [y, distance];
    }
    return best;
  });
}

/** For each row of the source the row of the target that matches it. */
function pointMap(source, target, solver, maskWeight) {
  const rows = shape => Array.from({ length: shape.n }, (_, i) => shape.phi.subarray(i * shape.k, (i + 1) * shape.k));
  if (solver === "least-squares") {
    return nearest(transported(source.phi, source.n, source.k, functionalMap(source, target, 0)), rows(target));
  }
  const weight = solver === "joint" ? maskWeight : 0.03;
  const forth = functionalMap(source, target, weight), back = functionalMap(target, source, weight);
  if (solver === "joint") {
    // Both directions beside each other: what either map misses counts.
    const beside = (left, right) => left.map((row, i) => Float64Array.from([...row, ...right[i]]));
    const image = (shape, map) => transported(shape.phi, shape.n, shape.k, map);
    return nearest(beside(image(source, forth), rows(source)), beside(rows(target), image(target, back)));
  }
  // Both directions: the map back, transposed, is another estimate of C.
  const transpose = back.map((row, i) => row.map((x, j) => (x + forth[j][i]) / 2)); // C^T [k_source, k_target]
  return nearest(rows(source), transported(target.phi, target.n, target.k, transpose));
}

async function main() {
  const [folderSource, folderTarget, model, out] = process.argv.slice(2);
  const session = await ort.InferenceSession.create(model);
  const metadata = readMetadata(model), k = +metadata["fmnet.k"];
  const source = await readShape(folderSource, session, k), target = await readShape(folderTarget, session, k);
  const matches = pointMap(source, target, metadata["fmnet.solver"], +metadata["fmnet.mask_weight"]);
  fs.writeFileSync(out, matches.map(y => (target.renumbered ? target.renumbered[y] : y) + "\n").join(""));
}

main().catch(error => { console.error(error); process.exit(1); });
