// What the page shows, as plain numbers: window.traction.model. Tests read it.

import {isSlow} from "./canvas.js";
import {gridPlace, roundContacts} from "./round.js";

const touch_ms = 1500;  // after a message of traction-touch, which sends one for each field
const sameTouch_ms = 500;  // without a contact, within one touch
const stale_ms = 3000;  // of a status
const none = [];
const mostArrows = isSlow ? 25 : 50;  // along a side

/** Of one sensor. Positions in mm, gel frame, unless a name says pixels. */
export class Model {
  constructor(name) {
    this.name = name;
    this.description = null;
    this.field = null;
    this.status = null;
    this.status_ms = -Infinity;  // when it came
    this.contacts = null;  // the last message of traction-touch
    this.isConnected = false;
    this.error = "";
    this.time = null;  // of a recording: where it has got to
    this.health = null;  // of a live sensor: how well it measures, and what is wrong
    this.recorder = null;  // what is being recorded
    this.places_px = new Float32Array();  // of nodes in the camera's picture
    this.positions_mm = new Float32Array();  // x, y, z of nodes
    this.displacement_mm = new Float32Array();  // of the touched surface at the nodes: x, y, z
    this.surface_share = 0;  // of the gel's computation; below 1 the surface moves as a half space does
    this.columns = 0;
    this.rows = 0;
    this.markers_px = new Float32Array();  // where they are now; NaN: not seen
    this.peak = null;  // the last touch, when it was strongest: {field, force_N, seen_ms}
    this.fields = 0;  // that have come
    this.drawn = 0;
    this.rate_hz = 0;
    this.latency_ms = null;
    this.last_work_ms = 0;  // the page's own, for the frame drawn last
    this.work_ms = 0;  // the median of the last 60
    this.arrivals = [];
  }

  /** Of the zero in force; empty: there is none. */
  get zeroId() {
    return String(this.description?.zero?.id ?? "");
  }

  takeDescription(description) {
    this.description = description;
    const {columns, rows, pitch_m, centre_m} = description.nodes;
    this.columns = columns;
    this.rows = rows;
    this.made = null;
    if (description.body) {
      this.positions_mm = description.body.node_positions_m.map((metre) => 1e3 * metre);
      return;
    }
    const positions = new Float32Array(3 * columns * rows);
    for (let row = 0, i = 0; row < rows; ++row) {
      for (let column = 0; column < columns; ++column, i += 3) {
        positions[i] = 1e3 * (centre_m[0] + pitch_m * (column - (columns - 1) / 2));
        positions[i + 1] = 1e3 * (centre_m[1] + pitch_m * (row - (rows - 1) / 2));
      }
    }
    this.positions_mm = positions;
  }

  takeField(field) {
    this.field = field;
    ++this.fields;
    if (field.valid) this.valid = field;
    if (field.valid && isTouch(field)) {
      const force_N = Math.hypot(...field.resultant_N);
      if (!this.#isSameTouch || force_N >= this.peak.force_N) this.peak = {field, force_N};
      this.peak.seen_ms = performance.now();
    }
    this.#time(field.header);
  }

  /** No fields come, so that what is shown is not of now. */
  get isStale() {
    return !this.isConnected || this.health?.health === "no_fields";
  }

  get #isSameTouch() {
    return this.peak !== null && performance.now() - this.peak.seen_ms < sameTouch_ms;
  }

  /** A field that is not valid for a moment ends no touch. */
  get isTouched() {
    return this.field !== null && (this.field.valid ? isTouch(this.field) : this.#isSameTouch);
  }

  /** What the views draw: the newest field; while nothing touches, the last touch. */
  get shown() {
    if (this.isGhost) return this.peak.field;
    return this.field.valid || !this.isTouched ? this.field : this.valid;
  }

  get isGhost() {
    return !this.isTouched && this.peak !== null && this.peak.field.force_N.length === this.field.force_N.length;
  }

  /** "last touch, 12 s ago: " while that is what is drawn. */
  get ghostWords() {
    if (!this.isGhost) return "";
    const seconds = Math.round((performance.now() - this.peak.seen_ms) / 1e3);
    return `last touch, ${seconds < 120 ? `${seconds} s` : `${Math.round(seconds / 60)} min`} ago: `;
  }

  takeMarkers(markers) {
    const rest = this.description?.zero?.rest_position_px;
    if (!rest || rest.length !== markers.displacement_px.length) return;
    if (this.markers_px.length !== rest.length) this.markers_px = new Float32Array(rest.length);
    for (let i = 0; i < rest.length; ++i) {
      this.markers_px[i] = markers.marker_valid[i >> 1] ? rest[i] + markers.displacement_px[i] : NaN;
    }
  }

  takeSurface({displacement_mm, share}) {
    this.surface_share = share;
    if (this.field?.valid === false && this.isTouched) return;  // without forces for a moment
    this.displacement_mm = displacement_mm;
  }

  takeStatus(status) {
    this.status = status;
    this.status_ms = performance.now();
  }

  /** The status, unless it is of before: one comes each second. */
  get newStatus() {
    return this.time || performance.now() - this.status_ms < stale_ms ? this.status : null;
  }

  takeContacts(message) {
    if (this.time?.speed === 0 && !message.valid) return;  // a recording that is paused is no silence
    this.contacts = message;
    this.contacts_ms = performance.now();
  }

  get #isTouchHere() {
    return this.contacts !== null && (this.time !== null || performance.now() - this.contacts_ms < touch_ms);
  }

  /** Contacts of traction-touch that have begun and not ended; null: it does not run. */
  get tracked() {
    return this.#isTouchHere ? this.contacts.contacts.filter(({phase}) => phase !== "end") : null;
  }

  get criticalPoints() {
    return this.#isTouchHere ? this.contacts.critical_points : [];
  }

  takePlaces({places_px}) {
    this.places_px = places_px;
    this.made = null;
  }

  area_mm2(node) {
    return this.description.body ? 1e6 * this.description.body.node_areas_m2[node] : this.mean_area_mm2;
  }

  get mean_area_mm2() {
    return (1e3 * this.description.nodes.pitch_m) ** 2;
  }

  /** @param quantity "pressure", along the normal; "shear", along the surface; "both", their magnitude */
  pressures_kPa(quantity) {
    const {force_N} = this.shown, normals = this.description.body?.node_normals, values = new Float32Array(force_N.length / 3);
    for (let i = 0; i < values.length; ++i) {
      const x = force_N[3 * i], y = force_N[3 * i + 1], z = force_N[3 * i + 2];
      if (x === 0 && y === 0 && z === 0) continue;
      const all = Math.sqrt(x * x + y * y + z * z);
      const pressed = normals ? x * normals[3 * i] + y * normals[3 * i + 1] + z * normals[3 * i + 2] : z;
      const value = quantity === "both" ? all : quantity === "pressure" ? pressed : Math.sqrt(Math.max(0, all * all - pressed * pressed));
      values[i] = (1e3 * value) / this.area_mm2(i);
    }
    return values;
  }

  /** A point of the gel frame [m], as column and row. */
  gridPlace(point_m) {
    return gridPlace(this, point_m);
  }

  /** Contacts of what is shown that their own model describes between the nodes. */
  get rounds() {
    if (this.roundsOf !== this.shown) [this.roundsOf, this.roundsMade] = [this.shown, roundContacts(this.shown, this.description, this.roundsMade)];
    return this.roundsMade;
  }

  /** Those that displacement_mm is of: the same, or hardly other ones, of a field some milliseconds before or after. */
  get roundsMoved() {
    return this.field === null || this.isGhost ? none : this.rounds;
  }

  /** What arrows are drawn of: the nodes; of more than can be told apart the sums over square blocks of them, in the
      middle of each. */
  get arrowGrid() {
    const {columns, rows, shown: field, positions_mm, places_px} = this;
    if (this.made?.field === field) return this.made;
    const block = Math.max(1, Math.ceil(Math.max(columns, rows) / mostArrows));
    const pitch_mm = 1e3 * block * this.description.nodes.pitch_m;
    if (block === 1) {
      return this.made = {field, columns, rows, pitch_mm, positions_mm, places_px, deviation_N: field.node_deviation_N, ...sizesOf(field.force_N)};
    }
    const wide = Math.ceil(columns / block), high = Math.ceil(rows / block);
    const gather = (values, size) => {
      const sums = new Float32Array(size * wide * high);
      for (let row = 0, from = 0; row < rows; ++row) {
        for (let column = 0; column < columns; ++column) {
          const to = size * (Math.floor(row / block) * wide + Math.floor(column / block));
          for (let k = 0; k < size; ++k) sums[to + k] += values[from++];
        }
      }
      return sums;
    };
    const mean = (values, size) => gather(values, size).map((sum, i) => {
      const at = Math.floor(i / size), column = at % wide, row = Math.floor(at / wide);
      return sum / (Math.min(block, columns - column * block) * Math.min(block, rows - row * block));
    });
    // Where they are stays from field to field.
    const at = this.made ?? {positions_mm: mean(positions_mm, 3), places_px: places_px.length ? mean(places_px, 2) : places_px};
    return this.made = {field, columns: wide, rows: high, pitch_mm, positions_mm: at.positions_mm, places_px: at.places_px,
      deviation_N: [], ...sizesOf(gather(field.force_N, 3))};
  }

  /** False: the daemon has no gel file, and no field comes. */
  get hasGel() {
    return this.description === null || this.description.layers.length > 0;
  }

  /** The field's nodes are the description's. */
  get isComplete() {
    return this.description !== null && this.field !== null && 3 * this.columns * this.rows === this.field.force_N.length;
  }

  #time(header) {
    const now = performance.now();
    this.arrivals.push([now, Number(header.frame_number)]);
    while (this.arrivals.length > 2 && this.arrivals[0][0] < now - 2000) this.arrivals.shift();
    const [[since, first], last] = [this.arrivals[0], this.arrivals[this.arrivals.length - 1]];
    this.rate_hz = last[0] > since ? (1e3 * (this.arrivals.length - 1)) / (last[0] - since) : 0;
    this.passed_over = Math.max(0, last[1] - first - (this.arrivals.length - 1));  // in the last two seconds
    if (this.time) return;  // what was recorded has none
    const latency = Number(header.arrived_real_ns - header.received_real_ns) / 1e6;
    if (latency > 1e4) {  // a recording that tractionctl replay sends again
      this.latency_ms = null;
      return;
    }
    this.latency_ms = this.latency_ms === null ? latency : this.latency_ms + 0.05 * (latency - this.latency_ms);
  }
}

const isTouch = ({contacts, method}) => contacts.length > 0 || method === "whole_face";

function sizesOf(force_N) {
  const magnitude_N = new Float32Array(force_N.length / 3);
  let largest_N = 0;
  for (let i = 0; i < magnitude_N.length; ++i) {
    const x = force_N[3 * i], y = force_N[3 * i + 1], z = force_N[3 * i + 2];
    magnitude_N[i] = Math.sqrt(x * x + y * y + z * z);
    largest_N = Math.max(largest_N, magnitude_N[i]);
  }
  return {force_N, magnitude_N, largest_N};
}

/** Standard deviations: noise and systematic part together. */
export function deviations({noise, systematic}) {
  return [0, 4, 8].map((i) => Math.sqrt(Math.max(0, noise[i] + systematic[i])));
}
