"use strict";
// One run of the module: an instance whose memory goes with this worker.

/** What the page gets as text, as JSON; everything else are bytes. */
const TEXT = ["error", "viewer"], JSON_KINDS = ["event", "summary", "shape"];

onmessage = async ({ data: { module, job } }) => {
  let memory;
  let failure = null;
  const decoder = new TextDecoder();
  const send = (kindAt, kindLength, at, length) => {
    const bytes = new Uint8Array(memory.buffer, at >>> 0, length >>> 0);
    const kind = decoder.decode(new Uint8Array(memory.buffer, kindAt >>> 0, kindLength));
    if (kind === "panic") failure = decoder.decode(bytes);
    else if (JSON_KINDS.includes(kind)) postMessage({ kind, value: JSON.parse(decoder.decode(bytes)) });
    else if (TEXT.includes(kind)) postMessage({ kind, value: decoder.decode(bytes) });
    else { const copy = bytes.slice(); postMessage({ kind, value: copy }, [copy.buffer]); }
  };
  try {
    const { exports } = await WebAssembly.instantiate(module, { page: { send } });
    memory = exports.memory;
    const given = bytes => {
      const at = exports.allocate(bytes.length) >>> 0;
      new Uint8Array(memory.buffer, at, bytes.length).set(bytes);
      return [at, bytes.length];
    };
    if (job.file) {
      const name = given(new TextEncoder().encode(job.file.name));
      exports.describe(...name, ...given(new Uint8Array(await job.file.arrayBuffer())), job.wholeArea);
    } else {
      exports.match_described(...given(job.source), ...given(job.target));
    }
    postMessage({ kind: "end", value: memory.buffer.byteLength });
  } catch (error) {
    postMessage({ kind: "error", value: failure ? `The match failed: ${failure}. Please report it.` : stopped(error, memory) });
  }
};

/** Why the module ended without a word of its own. */
function stopped(error, memory) {
  const used = Math.round((memory ? memory.buffer.byteLength : 0) / 2 ** 20);
  if (error instanceof WebAssembly.RuntimeError)
    return `The match ended at ${used} MiB of memory, of which a page has at most 4096 MiB: the meshes are too large for this browser. ` +
      "Decimate them with another program, or use fmnet-infer.";
  return `The match cannot run in this browser: ${error.message}`;
}
