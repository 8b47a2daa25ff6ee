// What the page shows, as plain numbers: window.traction.model. Tests read it.

import {isSlow} from "./canvas.js";

const touch_ms = 1500;  // after a message of traction-touch, which sends one for each field
const mostArrows = isSlow ? 25 : 50;  // along a side

/** Of one sensor. Positions in mm, gel frame, unless a name says pixels. */
export class Model {
  constructor(name) {
    this.name = name;
    this.description = null;
    this.field = null;
    this.markers = null;
    this.status = null;
    this.contacts = null;  // the last message of traction-touch
    this.isConnected = false;
    this.error = "";
    this.time = null;  // of a recording: where it has got to
    this.health = null;  // of a live sensor: how well it measures, and what is wrong
    this.recorder = null;  // what is being recorded
    this.places_px = new Float32Array();  // of nodes in the camera's picture
    this.positions_mm = new Float32Array();  // x, y, z of nodes
    this.displacement_mm = new Float32Array();  // of the touched surface at the nodes: x, y, z
    this.columns = 0;
    this.rows = 0;
    this.magnitude_N = new Float32Array();
    this.largest_N = 0;
    this.markers_px = new Float32Array();  // where they are now; NaN: not seen
    this.fields = 0;  // that have come
    this.drawn = 0;
    this.rate_hz = 0;
    this.latency_ms = null;
    this.last_work_ms = 0;  // the page's own, for the frame drawn last
    this.work_ms = 0;  // the median of the last 60
    this.arrivals = [];
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
    const {force_N} = field;
    const nodes = force_N.length / 3;
    if (this.magnitude_N.length !== nodes) this.magnitude_N = new Float32Array(nodes);
    let largest = 0;
    for (let i = 0; i < nodes; ++i) {
      const x = force_N[3 * i], y = force_N[3 * i + 1], z = force_N[3 * i + 2];
      const size = Math.sqrt(x * x + y * y + z * z);
      this.magnitude_N[i] = size;
      if (size > largest) largest = size;
    }
    this.largest_N = largest;
    this.#time(field.header);
  }

  takeMarkers(markers) {
    this.markers = markers;
    const rest = this.description?.zero?.rest_position_px;
    if (!rest || rest.length !== markers.displacement_px.length) return;
    if (this.markers_px.length !== rest.length) this.markers_px = new Float32Array(rest.length);
    for (let i = 0; i < rest.length; ++i) {
      this.markers_px[i] = markers.marker_valid[i >> 1] ? rest[i] + markers.displacement_px[i] : NaN;
    }
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

  /** What arrows are drawn of: the nodes; of more than can be told apart the sums over square blocks of them, in the
      middle of each. */
  get arrowGrid() {
    if (this.made?.field === this.field) return this.made;
    const {columns, rows, field, positions_mm, places_px} = this;
    const block = Math.max(1, Math.ceil(Math.max(columns, rows) / mostArrows));
    const pitch_mm = 1e3 * block * this.description.nodes.pitch_m;
    if (block === 1) {
      const {magnitude_N, largest_N} = this;
      return this.made = {field, columns, rows, pitch_mm, force_N: field.force_N, magnitude_N, largest_N, positions_mm, places_px};
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
    const force_N = gather(field.force_N, 3), magnitude_N = new Float32Array(wide * high);
    let largest_N = 0;
    for (let i = 0; i < magnitude_N.length; ++i) {
      const x = force_N[3 * i], y = force_N[3 * i + 1], z = force_N[3 * i + 2];
      magnitude_N[i] = Math.sqrt(x * x + y * y + z * z);
      largest_N = Math.max(largest_N, magnitude_N[i]);
    }
    return this.made = {field, columns: wide, rows: high, pitch_mm, force_N, magnitude_N, largest_N,
      positions_mm: at.positions_mm, places_px: at.places_px};
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

/** Standard deviations: noise and systematic part together. */
export function deviations({noise, systematic}) {
  return [0, 4, 8].map((i) => Math.sqrt(Math.max(0, noise[i] + systematic[i])));
}
