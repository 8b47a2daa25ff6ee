// Reads force fields from tractiond, through traction-view, in browsers and in Node:
//
//     import {fields} from "traction";
//     for await (const field of fields()) console.log(field.resultant_N);
//
// Messages and their form: messages.js. The protocol of the WebSocket: docs/viewer.md.
import WebSocket from "#websocket";

import {TractionError, malformed} from "./errors.js";
import {answerIn, decode} from "./messages.js";
import {PairedContacts} from "./paired_contacts.js";

export {TractionError, decode};

/** Where traction-view has the first of its sensors. */
export const usual = "http://127.0.0.1:9880/stream/0";

const root = "traction/v1/";
const kinds = {field: "Field", markers: "Markers", description: "Description", status: "Status", preview: "Preview",
  contacts: "Contacts", grasp: "Grasp"};
const usualTopics = ["field", "markers", "description", "status"];  // previews are made for who wants them, contacts and grasps by traction-touch
const version = 1;
const shortest_ms = 200, longest_ms = 3000;  // before a connection is tried again
const turn_ms = 250;  // between two looks whether traction-touch is silent
const text = new TextDecoder();

/** From anywhere, for people: what a terminal would take as a command is left out. */
const printable = (bytes) => bytes.slice(0, 64).replace(/[^\x20-\x7e]/g, "?");

/** now, as CLOCK_REALTIME [ns] */
const realtime_ns = () => BigInt(Math.round(1e3 * (performance.timeOrigin + performance.now()))) * 1000n;

function split(frame) {
  const end = frame.indexOf(0);
  if (end < 0) throw malformed("a frame has no topic");
  return [text.decode(frame.subarray(0, end)), frame.subarray(end + 1)];
}

/** A code, a blank, a sentence. */
function errorOf(bytes) {
  const [, code, sentence] = /^(\w+) ?(.*)$/s.exec(text.decode(bytes)) ?? [];
  return new TractionError(code ?? "malformed", sentence ?? "");
}

/**
 * One sensor. Connects by itself, again and again, until close(). Options:
 * - url: of the sensor's stream at traction-view, http: or ws:
 * - mode: "newest": of each kind of message the newest alone, nothing that waits; "stream": all of them, in order
 * - topics: array of "field", "markers", "description", "status", "preview", "contacts", "grasp" (of traction-touch), and
 *   traction-view's own "places", "surface", "picture" (a preview as JPEG); "time" and "recorder" come unasked
 * - onMessage(message), with message.kind; onError(TractionError); onConnected(boolean)
 *
 * Of contacts, each that begins ends once, whatever happens to traction-touch and to messages: one that was there before
 * begins when it is first seen; one that is missing in a message, or is of another run, ends in it; and all end in a
 * message of the library's own after a second without a message of traction-touch.
 */
export class Subscriber {
  /** Messages of mode "stream" that were sent since this subscriber joined and did not arrive, by gaps in their
      sequence. A restart of the daemon is no loss. */
  lost = 0;
  /** How often the daemon was started anew. */
  restarts = 0;
  isConnected = false;

  #seen = new Map();  // topic -> last boot and sequence
  #boots = new Map();  // sensor -> its daemon's last start
  #touches = new Map();  // topic -> PairedContacts
  #turns = null;  // while contacts are open
  #questions = new Map();  // id -> what to do with the answer
  #options;
  #socket = null;
  #timer = null;
  #wait_ms = shortest_ms;
  #isClosed = false;
  #id = 0;

  constructor(options = {}) {
    this.#options = {url: usual, mode: "newest", topics: usualTopics, ...options};
    this.#connect();
  }

  close() {
    this.#isClosed = true;
    clearTimeout(this.#timer);
    clearInterval(this.#turns);
    this.#socket?.close();
  }

  #connect() {
    const {url, mode, topics} = this.#options;
    const target = new URL(url.replace(/^http/, "ws"));
    target.search = `mode=${mode}&topics=${topics.join(",")}`;
    const socket = new WebSocket(target.href);
    this.#socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.#wait_ms = shortest_ms;
      this.isConnected = true;
      this.#options.onConnected?.(true);
    };
    socket.onmessage = (event) => {
      this.#take(new Uint8Array(event.data));
      if (mode === "newest") socket.send("next");  // and not before: what lies here unread grows old
    };
    socket.onerror = () => {};  // it is closed then
    socket.onclose = () => this.#end();
  }

  #end() {
    for (const {fail} of this.#questions.values()) fail(new TractionError("no_answer", "the connection has ended"));
    this.#questions.clear();
    if (this.isConnected) this.#options.onConnected?.(false);
    this.isConnected = false;
    if (this.#isClosed) return;
    this.#timer = setTimeout(() => this.#connect(), this.#wait_ms * (0.5 + Math.random()));
    this.#wait_ms = Math.min(2 * this.#wait_ms, longest_ms);
  }

  #take(frame) {
    try {
      const [topic, bytes] = split(frame);
      const message = this.#read(topic, bytes);
      if (message) this.#options.onMessage?.(message);
    } catch (error) {
      if (!(error instanceof TractionError)) throw error;
      this.#options.onError?.(error);
    }
  }

  /** Null: nothing that this version knows. */
  #read(topic, bytes) {
    if (topic === "error") throw errorOf(bytes);
    if (/^(reply|done|error)\//.test(topic)) return this.#answer(topic, bytes), null;
    if (topic === "view/places") return {kind: "places", places_px: new Float32Array(bytes.slice().buffer)};
    if (topic === "view/surface") {
      const numbers = new Float32Array(bytes.slice(8).buffer);
      return {kind: "surface", sequence: new DataView(bytes.buffer, bytes.byteOffset).getBigUint64(0, true),
        share: numbers[0], displacement_mm: numbers.subarray(1)};
    }
    if (topic === "view/picture") {
      const [place, jpeg] = split(bytes);
      return {kind: "picture", ...JSON.parse(place), jpeg};
    }
    if (/^view\/(time|recorder|health)$/.test(topic)) return {kind: topic.slice(5), ...JSON.parse(text.decode(bytes))};
    if (topic !== "" && !topic.startsWith(root)) {
      throw new TractionError("version", `what comes is ${printable(topic)}, this library reads ${root}`);
    }
    const kind = topic === "" ? "field" : /^traction\/v1\/[^/]*\/(\w+)\/$/.exec(topic)?.[1];
    if (!kinds[kind]) return null;
    const message = {kind, ...decode(kinds[kind], bytes)};
    message.header.arrived_real_ns = realtime_ns();
    this.#count(topic, message.header);
    if (kind === "contacts") this.#pair(topic, message);
    return message;
  }

  #pair(topic, message) {
    if (!this.#touches.has(topic)) this.#touches.set(topic, new PairedContacts());
    const paired = this.#touches.get(topic);
    paired.complete(message, performance.now());
    if (paired.areOpen && !this.#isClosed) this.#turns ??= setInterval(() => this.#endSilent(), turn_ms);
  }

  #endSilent() {
    const all = [...this.#touches.values()];
    for (const paired of all) {
      const ends = paired.endIfSilent(performance.now());
      if (!ends) continue;
      ends.header.arrived_real_ns = realtime_ns();
      this.#options.onMessage?.(ends);
    }
    if (all.some(({areOpen}) => areOpen)) return;
    clearInterval(this.#turns);
    this.#turns = null;
  }

  #count(topic, {sensor, boot, sequence}) {
    if ((this.#boots.get(sensor) ?? boot) !== boot) ++this.restarts;
    this.#boots.set(sensor, boot);
    const before = this.#seen.get(topic);
    if (this.#options.mode === "stream" && topic !== "" && before?.boot === boot && before.sequence !== 0n &&
        sequence > before.sequence + 1n) {
      this.lost += Number(sequence - before.sequence - 1n);
    }
    this.#seen.set(topic, {boot, sequence});
  }

  // Asking.

  /** @returns a promise of the last status published. All of them reject with TractionError. */
  status() { return this.#ask("status", "status"); }
  describe() { return this.#ask("describe", "description"); }
  /** Takes what the camera sees now as the unloaded gel, and waits for it. */
  zero() { return this.#ask("zero", "zero"); }
  /** Restores the previous zero. */
  undoZero() { return this.#ask("undo", "zero"); }

  /** Begins a recording in traction-view's directory, and resolves with its name. */
  record() { return this.#ask("record", "done"); }
  /** Ends it, and resolves with what is in it, for people. */
  stopRecording() { return this.#ask("stop", "done"); }

  /**
   * Carries out a step of a setup (traction-view --setup), and resolves with its result; docs/viewer.md lists the steps.
   * @param request null: what there is
   */
  setup(request = null) { return this.#ask(request ? `setup ${JSON.stringify(request)}` : "setup", "done").then(JSON.parse); }

  /** Of a recording: goes on from there [s], at so many times its own pace; 0 shows that moment. */
  play(from_s, speed = 1) {
    if (this.isConnected) this.#socket.send(`play ${from_s} ${speed}`);
  }

  #ask(question, answer) {
    return new Promise((succeed, fail) => {
      if (!this.isConnected) return fail(new TractionError("no_answer", "there is no connection to traction-view"));
      const id = String(++this.#id);
      this.#questions.set(id, {answer, succeed, fail});
      this.#socket.send(`ask ${id} ${question}`);
    });
  }

  #answer(topic, bytes) {
    const [how, id] = topic.split("/");
    const asked = this.#questions.get(id);
    if (!asked) return;
    this.#questions.delete(id);
    try {
      if (how === "error") throw errorOf(bytes);
      if (how === "done") return asked.succeed(text.decode(bytes));
      const reply = decode("Reply", bytes);
      if (reply.version !== version) {
        throw new TractionError("version", `the daemon speaks version ${reply.version}, this library ${version}`);
      }
      if (reply.error) throw new TractionError("refused", reply.error);
      if (answerIn(reply) !== asked.answer) throw malformed("the reply does not answer the request");
      asked.succeed(reply[asked.answer]);
    } catch (error) {
      asked.fail(error);
    }
  }
}

/**
 * Messages one after another: for await (const message of messages({mode: "stream"})). Ends never; errors are thrown, and
 * the next call goes on. What is not taken in time waits, at most `queue` of them, the oldest are dropped first.
 */
export function messages({queue = 1000, ...options} = {}) {
  const waiting = [];
  let wake = null;
  const put = (item) => {
    if (waiting.length >= queue) waiting.shift();
    waiting.push(item);
    wake?.();
  };
  const subscriber = new Subscriber({
    ...options, onMessage: (message) => put({message}), onError: (error) => put({error})});
  return {
    subscriber,
    async next() {
      while (waiting.length === 0) await new Promise((resolve) => { wake = resolve; });
      const {message, error} = waiting.shift();
      if (error) throw error;
      return {value: message, done: false};
    },
    async return() {
      subscriber.close();
      return {value: undefined, done: true};
    },
    [Symbol.asyncIterator]() { return this; },
  };
}

/** Fields alone, every one. */
export const fields = (options = {}) => messages({mode: "stream", ...options, topics: ["field"]});
