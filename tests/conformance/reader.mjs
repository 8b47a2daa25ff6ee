// The JavaScript client under the conformance suite: docs/clients.md says what a reader is. reader.mjs BUILD MODE ENDPOINT
// starts a traction-view of its own, for the client reads through one.
import {spawn} from "node:child_process";
import {createInterface} from "node:readline";
import {pathToFileURL} from "node:url";

const [build, mode, endpoint] = process.argv.slice(2);
const {Subscriber} = await import(pathToFileURL(`${build}/client/viewer/npm/client/javascript/traction.js`));

const masks = new Set(["node_valid", "marker_valid", "marker_present"]);
const widths = {force_N: 3, node_deviation_N: 3, displacement_px: 2, rest_position_px: 2, node_positions_m: 3,
  node_normals: 3, marker_positions_m: 3};

/** As JSON has it; numbers of 64 bits whole. */
function json(value, name = "", parent = {}) {
  if (typeof value === "bigint") return String(value);
  if (name === "pixels") return JSON.stringify(Buffer.from(value).toString("base64"));
  if (masks.has(name)) return json(Array.from(value, Boolean));
  if (ArrayBuffer.isView(value) || Array.isArray(value)) {
    const list = Array.from(value);
    // Contact has a force_N of one vector.
    const width = ArrayBuffer.isView(value) ? widths[name] : undefined;
    if (!width) return `[${list.map((each) => json(each)).join(",")}]`;
    const rows = Array.from({length: list.length / width}, (_, i) => list.slice(width * i, width * (i + 1)));
    return `[${rows.map((row) => json(row)).join(",")}]`;
  }
  if (value === null || typeof value !== "object") return JSON.stringify(value);
  return `{${Object.entries(value).map(([key, each]) => `${JSON.stringify(key)}:${json(each, key, value)}`).join(",")}}`;
}

/** The members as tractionctl names and nests them. */
function echo(kind, message) {
  const out = {...message};
  delete out.kind;
  if (kind === "zero") {
    const {id, time_ns, requested, requested_by} = out.zero;
    delete out.zero;
    return {id, time_ns, requested, requested_by, ...out};
  }
  const {arrived_real_ns, ...header} = out.header;
  for (const name of ["header", "timestamp", "host"]) delete out[name];
  const told = {topic: kind, ...header, ...out};
  if (kind === "field") {
    if (!told.centre_of_pressure_valid) told.centre_of_pressure_m = null;
    delete told.centre_of_pressure_valid;
  }
  if (kind === "description") {
    told.layers = out.layers.map(({darker, ...layer}) => ({...layer, contrast: darker ? "darker" : "brighter"}));
    if (told.layers.length === 0) told.gel = null;  // the daemon runs without a gel
    told.calibration_time_ns = out.calibration.time_ns;
    told.calibration = header.calibration;
    told.zero = header.zero;
    told.rest_pose = out.zero;
  }
  return told;
}

const print = (members) => process.stdout.write(`{${members}}\n`);

function url() {
  const where = mode === "control" ? ["--connect", "tcp://127.0.0.1:9", "--control", endpoint]
      : ["--connect", endpoint, ...(mode === "latest" ? ["--latest"] : [])];
  const bridge = spawn("setpriv", ["--pdeathsig", "TERM", `${build}/bin/traction-view`, ...where, "--listen", "0"],
                       {stdio: ["ignore", "pipe", "inherit"]});
  return new Promise((resolve) => {
    createInterface(bridge.stdout).on("line", (line) => resolve(/http\S+/.exec(line)[0] + "stream/0"));
  });
}

const at = await url();
if (mode === "control") {
  const subscriber = new Subscriber({url: at, topics: ["status"]});
  const asks = {status: "status", describe: "describe", zero: "zero", undo: "undoZero"};
  for await (const line of createInterface(process.stdin)) {
    const kind = {describe: "description", undo: "zero"}[line] ?? line;
    while (!subscriber.isConnected) await new Promise((resolve) => setTimeout(resolve, 20));
    await subscriber[asks[line]]().then((reply) => print(`"message":${json(echo(kind, reply))}`),
                                        (error) => print(`"error":${json(error.code)}`));
  }
} else {
  const subscriber = new Subscriber({
    url: at, mode: "stream", topics: ["field", "markers", "description", "status", "preview", "contacts", "grasp"],
    onMessage: (message) => print(`"message":${json(echo(message.kind, message))},"lost":${subscriber.lost}`),
    onError: (error) => print(`"error":${json(error.code)},"lost":${subscriber.lost}`)});
}
