"use strict";
// The page: takes two files, has a worker match them, shows what comes back.

/** Bytes of a file beyond which it is not read. */
const LARGEST = 256e6;
const FILES = [
  ["map.txt", "Map, a target vertex a line (.txt)", "text/plain"],
  ["map.csv", "Map with confidences (.csv)", "text/csv"],
  ["pair.glb", "Coloured pair (.glb)", "model/gltf-binary"],
];
/** Files of more bytes than this together are not described at the same time, for the sake of the memory. */
const AT_ONCE = 40e6;
const byId = id => document.getElementById(id);
const chosen = { source: null, target: null };
const module = compiled();
module.catch(error => fail(error.message));
/** The match under way, 0 for none, and its workers. */
let current = 0, matches = 0;
const workers = new Set();
let urls = [];

async function compiled() {
  try {
    const response = await fetch("fmnet.wasm");
    if (!response.ok) throw new Error(`fmnet.wasm: ${response.status}`);
    // Some servers do not know the type of .wasm, which streaming insists on.
    if (response.headers.get("Content-Type") === "application/wasm") return await WebAssembly.compileStreaming(response);
    return await WebAssembly.compile(await response.arrayBuffer());
  } catch (error) {
    throw new Error(`The module cannot be loaded: ${error.message}. The page has to come from a web server; see its README.`);
  }
}

// What to match.

function choose(side, file) {
  chosen[side] = file;
  const shown = new DataTransfer();
  if (file) shown.items.add(file);
  byId(side).files = shown.files;
  byId(side + "-name").textContent = file ? `${file.name}, ${size(file.size)}` : "Choose a file, or drop it here.";
  refresh();
}
function refresh() {
  byId("match").disabled = current !== 0 || !chosen.source || !chosen.target;
  byId("demo").disabled = current !== 0;
  byId("cancel").hidden = current === 0;
}
function size(bytes) { return bytes < 1e6 ? `${Math.ceil(bytes / 1e3)} kB` : `${(bytes / 1e6).toFixed(1)} MB`; }

for (const side of ["source", "target"]) {
  byId(side).addEventListener("change", event => choose(side, event.target.files[0] ?? null));
}
for (const zone of document.querySelectorAll(".shape")) {
  zone.addEventListener("dragover", () => zone.classList.add("over"));
  for (const end of ["dragleave", "drop"]) zone.addEventListener(end, () => zone.classList.remove("over"));
}
addEventListener("dragover", event => event.preventDefault());
addEventListener("drop", event => {
  event.preventDefault();
  const files = event.dataTransfer.files;
  if (current !== 0 || files.length === 0) return;
  const zone = event.target.closest?.(".shape");
  if (files.length > 1) { choose("source", files[0]); choose("target", files[1]); }
  else choose(zone ? zone.dataset.side : chosen.source && !chosen.target ? "target" : "source", files[0]);
  say(chosen.source && chosen.target ? "Both files are there." : "One more file is needed.");
});
byId("form").addEventListener("submit", event => { event.preventDefault(); if (!byId("match").disabled) match(); });
byId("cancel").addEventListener("click", () => { stop(); say("Cancelled."); byId("match").focus(); });
byId("demo").addEventListener("click", async () => {
  clear();
  try {
    const files = await Promise.all(["source.ply", "target.ply"].map(async name => {
      const response = await fetch("demo/" + name);
      if (!response.ok) throw new Error(`demo/${name}: ${response.status}`);
      return new File([await response.blob()], name);
    }));
    byId("partial").checked = false;
    choose("source", files[0]);
    choose("target", files[1]);
    match();
  } catch (error) { fail(`The demo pair cannot be loaded: ${error.message}`); }
});

// Matching.

async function match() {
  clear();
  const large = [chosen.source, chosen.target].find(file => file.size > LARGEST);
  if (large) {
    fail(`${large.name} has ${size(large.size)}; the page takes files of up to ${size(LARGEST)}. Decimate the mesh with another program.`);
    return;
  }
  const own = current = ++matches;
  refresh();
  say("Loading.");
  const state = { start: performance.now(), began: new Map(), memory: 0, module: null };
  try {
    state.module = await module;
    if (own === current) show(await run(await described(state), state), state);
  } catch (error) {
    if (own === current) fail(error.message);
  }
}
/** Both shapes as bytes. A part is in the unit of its whole, which is described first. */
async function described(state) {
  const { source, target } = chosen, partial = byId("partial").checked;
  const describe = (file, wholeArea) => run({ file, wholeArea }, state);
  let shapes;
  if (partial || source.size + target.size > AT_ONCE) {
    const whole = await describe(target, 0);
    shapes = [await describe(source, partial ? whole.shape.area : 0), whole];
  } else shapes = await Promise.all([describe(source, 0), describe(target, 0)]);
  return { source: shapes[0].described, target: shapes[1].described };
}
/** Everything that a run of the module sends, by kind. */
function run(job, state) {
  const worker = new Worker("worker.js"), sent = {};
  workers.add(worker);
  return new Promise((resolve, reject) => {
    worker.onmessage = ({ data: { kind, value } }) => {
      if (kind === "event") event(value, state);
      else if (kind === "error") reject(new Error(value));
      else if (kind === "end") { state.memory = Math.max(state.memory, value); worker.terminate(); resolve(sent); }
      else sent[kind] = value;
    };
    worker.onerror = event => reject(new Error(`The match failed: ${event.message}`));
    worker.postMessage({ module: state.module, job });
  });
}
function event(value, state) {
  if (value.warning) return warn(value.warning);
  const stage = value.started ?? value.finished, key = `${value.subject}: ${stage}`;
  if (value.started) { state.began.set(key, performance.now()); say(key); return; }
  const seconds = (performance.now() - (state.began.get(key) ?? state.start)) / 1e3;
  add("#stages ol", `${key}, ${seconds.toFixed(2)} s`);
  byId("stages").hidden = false;
}
function stop() {
  workers.forEach(worker => worker.terminate());
  workers.clear();
  current = 0;
  refresh();
}

// What came of it.

function show(sent, state) {
  stop();
  const seconds = (performance.now() - state.start) / 1e3, s = sent.summary;
  byId("summary").replaceChildren(...verdict(s, seconds));
  for (const [name, label, type] of FILES) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([sent[name]], { type }));
    link.download = name;
    link.textContent = label;
    urls.push(link.href);
    byId("downloads").append(link);
  }
  for (const [label, number] of measures(s, state.memory)) {
    const row = byId("measures").insertRow(), head = document.createElement("th");
    head.scope = "row";
    head.textContent = label;
    row.append(head);
    row.insertCell().textContent = number;
  }
  byId("viewer").srcdoc = sent.viewer;
  byId("result").hidden = false;
  say(`Done in ${seconds.toFixed(1)} s.`);
  byId("result-title").focus();
}
/** The map in words. */
function verdict(s, seconds) {
  const share = (part, whole) => `${(100 * part / whole).toFixed(1)} %`;
  const trust = document.createElement("span");
  const inside = s.mirrored ? "The map is mirrored: left and right are exchanged." : "The map as a whole is doubtful; see the warnings.";
  trust.textContent = s.doubtful ? inside + " " : "The map as a whole is not doubtful. ";
  if (s.doubtful) trust.className = "doubtful";
  const rest = `${s.matched} of ${s.n_source} vertices of the source are matched to the ${s.n_target} of the target, in ` +
    `${seconds.toFixed(1)} s. The mean error to expect is ${s.expected_error.toFixed(1)} % of the square root of the area. ` +
    `${s.doubtful_vertices} vertices (${share(s.doubtful_vertices, s.n_source)}) are doubtful on their own.`;
  return [trust, rest];
}
function measures(s, memory) {
  const q = s.quality, number = x => x.toPrecision(3), percent = x => `${(100 * x).toFixed(1)} %`;
  return [
    ["Probability that the mean error is above 10 %", percent(s.probability_bad)],
    ["Share of the target's area that is matched", percent(q.coverage)],
    ["Share of edges stretched more than five times", percent(q.stretched)],
    ["Share of the area turned inside out", percent(q.reversed)],
    ["Dirichlet energy (2 for an isometry)", number(q.dirichlet)],
    ["Distance from commuting with the Laplacians (0 to 1)", number(q.commutativity)],
    ["Distance from orthogonality", number(q.orthogonality)],
    ...(q.agreement === null ? [] : [["Mean cosine between the descriptors of matches", number(q.agreement)]]),
    ...(q.cycle === null ? [] : [["There and back, relative to sqrt(area)", number(q.cycle)]]),
    ...(s.way === null ? [] : [["Way to the map", s.way]]),
    ["Memory of the module", size(memory)],
  ];
}

// What is said.

function say(text) { byId("status").textContent = text; }
function add(list, text) {
  const item = document.createElement("li");
  item.textContent = text;
  document.querySelector(list).append(item);
}
function warn(text) { add("#warnings ul", text); byId("warnings").hidden = false; }
function fail(text) {
  stop();
  say("");
  byId("error").textContent = text;
  byId("error").hidden = false;
}
function clear() {
  urls.forEach(url => URL.revokeObjectURL(url));
  urls = [];
  for (const list of ["#warnings ul", "#stages ol", "#downloads", "#measures"]) document.querySelector(list).replaceChildren();
  for (const id of ["error", "warnings", "stages", "result"]) byId(id).hidden = true;
  byId("viewer").removeAttribute("srcdoc");
}
