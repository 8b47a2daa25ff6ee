// Writes the numbers and words beside the views.
import {say as set} from "./canvas.js";
import {deviations} from "./model.js";
import {makeRow, showRow} from "./touching.js";

export const flagWords = {};  // by their names, from the server
const lamps = {measuring: "good", doubtful: "warn", no_forces: "bad", no_fields: "warn"};
const cameraWords = {unknown: "not opened yet", waiting: "waiting for it", streaming: "streaming", lost: "lost, looking for it",
  connecting: "connecting"};
// Numbers of the ledger that are no losses, or are shown elsewhere; all others are shown.
const notLost = [ "received", "published", "in_flight", "no_rest_pose", "no_gel", "reconnects", "doubted", "invalid" ];
const lossWords = {
  wrong_size : "of wrong size",
  wrong_format : "of wrong format",
  evicted_before_track : "too late to track",
  evicted_before_solve : "too late to solve",
  evicted_before_publish : "too late to publish",
  discarded_at_stop : "discarded",
  missing : "never arrived"
};

/** Returns the number with its minus, unless it is zero as it is written. */
export const show = (value, digits) => value.toFixed(digits).replace(/^-(?!0*\.?0*$)/, "−").replace("-", "");
/** Returns "± 0.012", two standard deviations; with more digits where that would be ± 0.000; nothing if it is not known. */
export function spread(deviation, digits) {
  if (!(deviation > 0)) return "";
  const text = (2 * deviation).toFixed(digits);
  return `± ${Number(text) === 0 ? Number((2 * deviation).toPrecision(1)) : text}`;
}
const $ = (id) => document.getElementById(id);

function rows(list, count, make) {
  while (list.children.length > count) list.lastChild.remove();
  while (list.children.length < count) list.append(make());
  return list.children;
}

function element(name, inner = "") {
  const made = document.createElement(name);
  made.innerHTML = inner;
  return made;
}

/** Returns the state of the instrument, for the lamp: [colour, words]. */
export function stateOf(model) {
  if (!model.isConnected) return ["bad", "no connection to traction-view"];
  if (model.error) return ["bad", model.error];
  if (model.time?.trouble) return ["warn", `a recording; ${model.time.trouble}`];
  if (model.time) return [ "good", model.time.speed > 0 ? "a recording" : "a recording, paused" ];
  if (!model.health) return ["warn", "waiting for tractiond"];
  const {health, problems} = model.health;
  const words = {measuring: "measuring", doubtful: "measuring, with reservations", no_forces: `no valid forces: ${problems[0]}`};
  return [lamps[health], words[health] ?? problems[0]];
}

/** Returns what is wrong beside what the lamp says. */
function doubtsOf(model) {
  if (!model.health) {  // a recording
    const flags = (model.field?.header.flags ?? []).map((flag) => flagWords[flag] ?? flag);
    const remark = model.hasGel && model.status?.markers.remark;
    return remark ? [...flags, remark] : flags;
  }
  const {health, problems} = model.health;
  return health === "no_forces" || health === "no_fields" ? problems.slice(1) : problems;
}

export function showState(model) {
  const [colour, words] = stateOf(model);
  document.body.classList.toggle("stale", model.isStale && model.field !== null);
  $("state").firstElementChild.className = `lamp ${colour}`;
  set($("state-text"), words);
}

/** What would be undone. */
export function showZero({description}) {
  const {time_ns, requested_by} = description?.zero ?? {};
  const what = time_ns ? `the zero of ${new Date(Number(time_ns) / 1e6).toLocaleTimeString()}${requested_by ? `, by ${requested_by}` : ""}` : "the zero";
  const title = `Takes back ${what}: the one before is in force again (U)`;
  if ($("undo").title !== title) $("undo").title = title;
}

export function showForce(model) {
  const {field} = model, isValid = Boolean(field?.valid);
  const [force, moment] = isValid ? [field.resultant_N, field.moment_Nm.map((one) => 1e3 * one)] : [[], []];
  set($("magnitude"), isValid ? show(Math.hypot(...force), 3) : "–");
  const each = isValid ? [deviations(field.resultant_covariance_N2), deviations(field.moment_covariance_N2m2).map((one) => 1e3 * one)] : [[], []];
  const lines = rows($("components"), 3, () => element("tr", "<th scope=row></th><td></td><td></td>"));
  ["x", "y", "z"].forEach((axis, i) => {
    lines[i].className = axis;
    const [head, first, second] = lines[i].children;
    set(head, axis);
    [[first, force[i], each[0][i], 3], [second, moment[i], each[1][i], 2]].forEach(([cell, value, deviation, digits]) => {
      if (!cell.firstChild) cell.innerHTML = "<span></span> <small></small>";
      set(cell.firstChild, isValid ? show(value, digits) : "–");
      set(cell.lastChild, isValid ? spread(deviation, digits) : "");
    });
  });
}

export function showContacts(model) {
  const {tracked} = model, list = $("contacts"), isTracked = Boolean(tracked?.length);
  if (list.classList.toggle("tracked", isTracked) !== (list.firstChild?.className === "tracked")) list.replaceChildren();
  if (isTracked) {
    const lines = rows(list, tracked.length, makeRow);
    tracked.forEach((contact, i) => showRow(lines[i], contact));
    return;
  }
  const contacts = model.field?.contacts.slice(0, 5) ?? [];
  if (contacts.length === 0) {
    const [only] = rows($("contacts"), 1, () => element("li"));
    only.className = "empty";
    set(only, model.field === null ? "–" : model.field.method === "whole_face" ? "one large contact: the whole face" : "no contact");
    return;
  }
  const lines = rows($("contacts"), contacts.length, () => element("li"));
  contacts.forEach((contact, i) => {
    const size = Math.hypot(...contact.force_N);
    const [x, y] = contact.position_m.map((one) => show(1e3 * one, 1));
    if (lines[i].children.length !== 3) { lines[i].className = ""; lines[i].innerHTML = "<b></b><span></span><small></small>"; }
    set(lines[i].children[0], `${show(size, 2)} N ${spread(Math.hypot(...contact.force_deviation_N), 2)}`);
    set(lines[i].children[1], `${x}, ${y} mm`);
    set(lines[i].children[2], spread(1e3 * Math.max(...contact.position_deviation_m), 1));
  });
}

export function showFacts(model) {
  const {field, description, isStale, newStatus: status} = model;
  const lost = Object.entries(status?.ledger ?? {}).filter(([name, number]) => number > 0n && !notLost.includes(name));
  const number = lost.reduce((sum, [, one]) => sum + one, 0n), all = number + (status?.ledger.published ?? 0n);
  const causes = lost.sort(([, a], [, b]) => Number(b - a)).map(([name, one]) => `${one} ${lossWords[name] ?? name.replaceAll("_", " ")}`);
  const facts = {
    sensor : field?.header.sensor || model.name,
    camera : status ? cameraWords[status.camera] : "–",
    rate : model.rate_hz && !isStale ? `${model.rate_hz.toFixed(1)} /s${model.passed_over ? `, ${model.passed_over} skipped` : ""}`
                                                                              : "–",
    latency : model.latency_ms === null || isStale ? "–" : `${model.latency_ms.toFixed(1)} ms`,
    "in the daemon" : status ? `${(1e3 * status.latencies.total.p50_s).toFixed(1)} ms, 99 %: ${
                                   (1e3 * status.latencies.total.p99_s).toFixed(1)}`
                             : "–",
    lost : !status ? "–" : number === 0n ? "nothing" : `${number} of ${all}${causes.length > 1 ? ", most" : ""} ${causes[0].replace(/^\d+ /, "")}`,
    markers : field ? `${field.valid_markers} of ${
                          description?.layers.reduce((sum, layer) => sum + layer.columns * layer.rows, 0) ?? "–"}`
                    : "–",
    unexplained : field ? `${field.residual_px.toFixed(3)} px` : "–",
    "page's work" : `${model.work_ms.toFixed(1)} ms a frame`,
  };
  if (status?.camera_link?.temperature != null) facts["camera's temperature"] = `${status.camera_link.temperature.toFixed(1)} °C`;
  const list = $("facts");
  const names = Object.keys(facts);
  if (list.children.length !== 2 * names.length) list.replaceChildren(...names.flatMap(() => [element("dt"), element("dd")]));
  names.forEach((name, i) => {
    set(list.children[2 * i], name);
    set(list.children[2 * i + 1], facts[name]);
  });
  list.title = causes.join(", ");
  const words = doubtsOf(model).map((text) => (/^zero not verified/.test(text) && !model.time && !model.isTouched ?
    `${text}: if nothing touches the gel, press Z` : text));
  const lines = rows($("flags"), words.length, () => element("li"));
  words.forEach((text, i) => set(lines[i], text));
}
