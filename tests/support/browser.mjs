// Chromium without a window, on a page, for tests/support/browser.py: browser.mjs BUILD CHROMIUM FOLDER URL [WIDTH HEIGHT]
// Reads a line of JSON and answers with one: {"evaluate": EXPRESSION}, {"picture": FILE}, {"requests": true},
// {"ignoreRequests": true}, {"key": KEY}, {"size": [WIDTH, HEIGHT]}, {"accessibility": true}.
import {spawn} from "node:child_process";
import {readFileSync, writeFileSync} from "node:fs";
import {createInterface} from "node:readline";
import {createRequire} from "node:module";

const [build, chromium, folder, url, width = "1400", height = "900"] = process.argv.slice(2);
const require = createRequire(`${build}/client/viewer/npm/`);
const WebSocket = require("ws");

const child = spawn("setpriv", ["--pdeathsig", "KILL", chromium, "--headless=new", "--no-sandbox", "--disable-gpu-sandbox",
  "--disable-gpu", "--enable-unsafe-swiftshader", "--no-first-run", "--disable-extensions",
  "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage", "--no-proxy-server",
  "--remote-debugging-port=0", `--user-data-dir=${folder}`, `--window-size=${width},${height}`, "about:blank"],
  {stdio: ["ignore", "ignore", "pipe"], env: {...process.env, HOME: folder}});
const said = [];
const at = await new Promise((resolve, reject) => {
  createInterface(child.stderr).on("line", (line) => {
    said.push(line);
    const found = /ws:\/\/([^/]+)\//.exec(line);
    if (found) resolve(found[1]);
  });
  child.on("exit", () => reject(new Error(`chromium has ended: ${said.slice(-5).join("\n")}`)));
});

const [page] = (await (await fetch(`http://${at}/json/list`)).json()).filter(({type}) => type === "page");
const socket = new WebSocket(page.webSocketDebuggerUrl, {maxPayload: 2 ** 28});
await new Promise((resolve) => socket.on("open", resolve));
const waiting = new Map();
const requests = [], faults = [];
let traced = [], endTrace;
let id = 0;
socket.on("message", (text) => {
  const message = JSON.parse(text);
  if (message.id) return waiting.get(message.id)?.(message);
  const {method, params} = message;
  if (method === "Tracing.dataCollected") traced.push(...params.value);
  if (method === "Tracing.tracingComplete") endTrace();
  if (method === "Network.requestWillBeSent") requests.push(params.request.url);
  if (method === "Network.webSocketCreated") requests.push(params.url);
  if (method === "Runtime.exceptionThrown") faults.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
  if (method === "Log.entryAdded" && params.entry.level === "error") faults.push(params.entry.text);
});
const send = (method, params = {}) => new Promise((resolve, reject) => {
  waiting.set(++id, ({result, error}) => (error ? reject(new Error(`${method}: ${error.message}`)) : resolve(result)));
  socket.send(JSON.stringify({id, method, params}));
});
const evaluate = async (expression) => {
  const {result, exceptionDetails} = await send("Runtime.evaluate", {expression, returnByValue: true, awaitPromise: true});
  if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
  return result.value;
};

const tasks = {
  evaluate,
  async picture(file) {
    const {data} = await send("Page.captureScreenshot", {format: "png"});
    writeFileSync(file, Buffer.from(data, "base64"));
    return file;
  },
  async trace([file, milliseconds, categories]) {
    traced = [];
    const ended = new Promise((resolve) => { endTrace = resolve; });
    await send("Tracing.start", {transferMode: "ReportEvents", traceConfig: {includedCategories: categories.split(",")}});
    await new Promise((resolve) => setTimeout(resolve, milliseconds));
    await send("Tracing.end");
    await ended;
    writeFileSync(file, JSON.stringify(traced));
    return file;
  },
  metrics: async () => Object.fromEntries((await send("Performance.getMetrics")).metrics.map(({name, value}) => [name, value])),
  requests: () => ({requests, faults}),
  ignoreRequests: () => send("Network.disable"),  // else each message of a WebSocket goes through here, too
  async key(key) {
    const text = key.length === 1 ? key : undefined;
    await send("Input.dispatchKeyEvent", {type: "keyDown", key, text});
    await send("Input.dispatchKeyEvent", {type: "keyUp", key});
    return key;
  },
  size: ([width, height]) => send("Emulation.setDeviceMetricsOverride", {width, height, deviceScaleFactor: 1, mobile: width < 600}),
  async accessibility() {
    await evaluate(readFileSync(require.resolve("axe-core/axe.min.js"), "utf8") + ";0");
    return evaluate("axe.run().then(({violations}) => violations.map(({id, impact, nodes}) => " +
                    "({id, impact, nodes: nodes.map(({html}) => html.slice(0, 120))})))");
  },
};

for (const domain of ["Page", "Network", "Runtime", "Log", "Performance"]) await send(`${domain}.enable`);
await tasks.size([Number(width), Number(height)]);
await send("Page.navigate", {url});
console.log(JSON.stringify({ready: true}));
for await (const line of createInterface(process.stdin)) {
  const [[task, argument]] = Object.entries(JSON.parse(line));
  const told = await Promise.resolve(tasks[task](argument)).then((value) => ({value}), (error) => ({error: error.message}));
  console.log(JSON.stringify(told));
}
child.kill("SIGKILL");
process.exit();
