// View c: pressure, shear or both, as filled contours of a spline surface through the nodes, small round contacts as their model
// has them; and which nodes stick and slip.
import {Ground, blank, fit, say} from "./canvas.js";
import {show, spread} from "./numbers.js";
import {addMeanTraction, deviationAt, forcesBeside} from "./round.js";
import {Scale, between, newtons, pascals} from "./scale.js";
import {drawStickSlip, gradient} from "./stick_slip.js";
import {rampAt, theme} from "./theme.js";
import {drawTouching} from "./touching.js";

const levels = 9;  // so that those of a scale of 1, 2 or 5 are round
const margin = {left: 34, top: 12, right: 76, bottom: 24};  // [px]
const wide_px = 420, second_px = 56;  // of a view that shows newtons beside pascals, and their column
const bar_px = 12, dot_px = 2.5;
const mostDots = 24;  // for nodes, along a side
const faded = 0.3;  // of the last touch
const finest = 93;  // points along a side, at most, of what is drawn
const coarsest_px = 2.5;  // between points: closer than this nobody sees
const unseen = 8e-4;  // [kPa]
const touched = 0.05;  // of the strongest: what is to be in view
const room = 2, narrowest = 10, widest = 0.75;  // nodes around it; nodes along a side at least; share of the face from which on all of it is seen
const shrunk = 0.7;  // of the side that is seen: smaller than this it is enlarged
const settle_ms = 120, most_ms = 200, arrived = 0.01;  // as the camera of scene.js, in nodes
const label_px = 10, gap_px = 2;  // of a number on a line
const disc_px = 7;  // of a node that sticks or slips, from its middle
const farthest_px = 200;  // of a number from the middle of its contact
const angles = [0.75, 1, 0.5, 1.25, 0.25, 0, 1.5, 1.75].map((turn) => turn * Math.PI);  // in which numbers may stand, v being down
const components = {both: [0, 1, 2], pressure: [2], shear: [0, 1]};
/** What is drawn of a traction x, y, z. */
const made = {both: ([x, y, z]) => Math.sqrt(x * x + y * y + z * z), pressure: ([, , z]) => z, shear: ([x, y]) => Math.sqrt(x * x + y * y)};

/** Weights of four neighbours at t between the second and third (Catmull and Rom, 1974). */
function weights(t) {
  return [t * (t * (1 - 0.5 * t) - 0.5), 1 + t * t * (1.5 * t - 2.5), t * (0.5 + t * (2 - 1.5 * t)), 0.5 * t * t * (t - 1)];
}

/** A grid of numbers, or a part of one, finer: along rows, then along columns. */
export class Spline {
  constructor(columns, rows, times) {
    Object.assign(this, {columns, rows, times});
    this.wide = (columns - 1) * times + 1;
    this.high = (rows - 1) * times + 1;
    this.half = new Float32Array(this.wide * rows);
    this.values = new Float32Array(this.wide * this.high);
    this.weights = Array.from({length: times}, (_, i) => weights(i / times));
  }

  /** @param offset of the part's first number @param across numbers of the grid along a row */
  update(given, stride = 1, offset = 0, across = this.columns) {
    const {columns, rows, times, wide, high, half, values} = this;
    for (let r = 0; r < rows; ++r) {
      for (let x = 0; x < wide; ++x) {
        const c = Math.floor(x / times), w = this.weights[x % times];
        let sum = 0;
        for (let k = 0; k < 4; ++k) {
          const at = Math.min(Math.max(c + k - 1, 0), columns - 1);
          sum += w[k] * given[(r * across + at) * stride + offset];
        }
        half[r * wide + x] = sum;
      }
    }
    for (let y = 0; y < high; ++y) {
      const r = Math.floor(y / times), w = this.weights[y % times];
      const at = [-1, 0, 1, 2].map((k) => Math.min(Math.max(r + k, 0), rows - 1) * wide);
      for (let x = 0; x < wide; ++x) {
        values[y * wide + x] = w[0] * half[at[0] + x] + w[1] * half[at[1] + x] + w[2] * half[at[2] + x] + w[3] * half[at[3] + x];
      }
    }
    return values;
  }
}

export class Contours {
  /** what is drawn: "both", "pressure" or "shear" */
  quantity = "both";
  #pointer = null;
  #turns = [];  // of each contact: which of the angles its numbers stand at
  #wanted = null;  // what is to be seen of the grid: [column, row, columns, rows]
  #seen = null;    // what is seen
  #looked_ms = 0;
  #lookedAt = null;  // the nodes

  /** @param redraw is called when the pointer has moved */
  constructor(canvas, label, legend, redraw) {
    this.canvas = canvas;
    this.label = label;
    this.legend = legend;
    legend.querySelector("i").style.background = gradient;
    this.redraw = redraw;
    this.scale = new Scale(0.2);  // [kPa]
    this.ground = new Ground();
    this.picture = document.createElement("canvas");
    this.colours = Array.from({length: levels + 1}, (_, k) => rampAt(0.12 + (0.88 * (k + 0.5)) / (levels + 1)).map((one) => Math.round(255 * one)));
    canvas.addEventListener("pointermove", ({offsetX, offsetY}) => { this.#pointer = [offsetX, offsetY]; redraw(); });
    canvas.addEventListener("pointerleave", () => { this.#pointer = null; redraw(); });
  }

  draw(model) {
    const fitted = fit(this.canvas);
    if (!fitted) return;
    if (!model.isComplete || model.columns < 2 || model.rows < 2) return blank(fitted), say(this.label, "");
    const {context, width, height} = fitted;
    const {columns, rows} = model;
    const right = margin.right + (width > wide_px ? second_px : 0);
    const nodes = model.pressures_kPa(this.quantity), rounds = model.rounds;
    const seen = this.#look(model, nodes), [fromColumn, fromRow, across, upwards] = seen;
    const zoom = Math.max(1, Math.min((width - margin.left - right) / across, (height - margin.top - margin.bottom) / upwards));  // [px] of a node distance
    const edge = {left: Math.round((width - zoom * across - right + margin.left) / 2), top: margin.top};
    Object.assign(edge, {right: edge.left + zoom * across, low: edge.top + zoom * upwards});
    const left = edge.left - zoom * fromColumn, low = edge.low + zoom * fromRow;  // of the first node
    const part = this.#partOf(model, nodes, seen, zoom);
    const values = part ? this.#values(model, nodes, rounds, part) : null;
    let largest = 0;
    for (const one of values ?? []) if (one > largest) largest = one;
    const full = this.scale.update(largest);
    const {pitch_m, centre_m} = model.description.nodes;
    this.ground.put(fitted, [columns, rows, pitch_m, ...centre_m, full, left, low, zoom], (below) => {
      this.#axes(below, model, left, low, zoom, edge);
      this.#bar(below, edge.right + 18, edge.top, edge.low - edge.top, full, width > wide_px ? model.mean_area_mm2 : 0);
    });
    context.save();
    context.beginPath();
    context.rect(edge.left - 8, edge.top - 8, edge.right - edge.left + 16, edge.low - edge.top + 16);
    context.clip();
    context.translate(left, low);
    context.scale(zoom, -zoom);  // y is up; [node distances]
    context.imageSmoothingEnabled = true;
    context.globalAlpha = model.isGhost ? faded : 1;
    if (part) {
      this.#paint(values, full);
      const {column, row, times, wide, high} = part;
      context.drawImage(this.picture, column - 0.5 / times, row - 0.5 / times, wide / times, high / times);
      this.#lines(context, values, part, full, zoom);
    }
    context.globalAlpha = 1;
    const place = (point) => model.gridPlace(point);
    model.stick_slip = drawStickSlip(context, model, place);
    this.legend.hidden = model.stick_slip.length === 0;
    const taken = drawTouching(context, model, place);
    for (const {at_px: [u, v]} of model.stick_slip) taken.push([u - disc_px, v - disc_px, u + disc_px, v + disc_px]);
    context.fillStyle = theme.text;
    for (const contact of model.tracked ? [] : model.field.contacts) {
      const [x, y] = place(contact.position_m), [u, v] = [left + zoom * x, low - zoom * y];
      context.beginPath();
      context.arc(x, y, dot_px / zoom, 0, 7);
      context.fill();
      taken.push([u - dot_px, v - dot_px, u + dot_px, v + dot_px]);
    }
    context.restore();
    const numbers = part && !model.isGhost ? this.#numbers(context, model, values, part, full, {left, low, zoom, edge}, taken) : [];
    this.#underPointer(context, model, values, part, {left, low, zoom, edge});
    model.contours = {full_kPa: full, largest_kPa: largest, numbers, levels_kPa: Array.from({length: levels}, (_, i) => ((i + 1) * full) / (levels + 1))};
    say(this.label, model.ghostWords + (largest > 0 ? `most ${pascals(largest)}${rounds.length > 0 ? " by the contact's model" : ""}` :
      `nothing touches; a node is seen from ${newtons(model.description.solver.detection_limit_normal_N)}`));
  }

  /** What of the grid is seen: what is touched, with some room; all of it before anything touches. @returns [column, row, columns, rows] */
  #look(model, nodes) {
    const {columns, rows} = model, whole = [0, 0, columns - 1, rows - 1], counts = [columns - 1, rows - 1], least = Math.min(...counts);
    const isOther = this.#wanted === null || this.#lookedAt !== model.positions_mm;
    if (isOther) [this.#wanted, this.#seen, this.#lookedAt] = [whole, whole, model.positions_mm];
    const strongest = nodes.reduce((most, one) => Math.max(most, one), 0);
    if (strongest > 0 && !model.description.body) {
      const low = [columns, rows], high = [-1, -1];
      const add = (at, axis) => { low[axis] = Math.min(low[axis], at), high[axis] = Math.max(high[axis], at); };
      nodes.forEach((one, i) => { if (one > touched * strongest) [i % columns, Math.floor(i / columns)].forEach(add); });
      const [column, row, across, upwards] = this.#wanted, side = Math.max(high[0] - low[0] + 2 * room, high[1] - low[1] + 2 * room, Math.min(narrowest, least));
      const isWithin = [[column, across], [row, upwards]].every(([from, count], axis) => low[axis] >= from && high[axis] <= from + count);
      if (!isWithin || side < shrunk * Math.min(across, upwards)) {
        this.#wanted = side > widest * least ? whole : [0, 1].map((axis) => Math.min(Math.max((low[axis] + high[axis] - side) / 2, 0), counts[axis] - side)).concat(side, side);
      }
    }
    const now = performance.now(), step = 1 - Math.exp(-Math.min(now - this.#looked_ms, most_ms) / settle_ms);
    this.#looked_ms = now;
    const isThere = this.#wanted.every((one, i) => Math.abs(one - this.#seen[i]) < arrived);
    this.#seen = isThere ? this.#wanted : this.#seen.map((one, i) => one + step * (this.#wanted[i] - one));
    if (!isThere) this.redraw();
    return this.#seen;
  }

  /** The part of the grid that is seen, as fine as can be seen; null: nothing is to be seen. */
  #partOf(model, nodes, [fromColumn, fromRow, across, upwards], zoom) {
    if (nodes.every((one) => Math.abs(one) < unseen)) return null;
    const [[column, columnsSeen], [row, rowsSeen]] = [[fromColumn, across, model.columns], [fromRow, upwards, model.rows]].map(([from, size, count]) => {
      const first = Math.max(0, Math.floor(from));
      return [first, Math.min(count - 1, Math.ceil(from + size)) - first + 1];
    });
    const times = Math.max(1, Math.min(Math.floor((finest - 1) / (Math.max(columnsSeen, rowsSeen) - 1)), Math.ceil(zoom / coarsest_px)));
    if (this.splines?.[0].columns !== columnsSeen || this.splines[0].rows !== rowsSeen || this.splines[0].times !== times) {
      this.splines = [0, 1, 2].map(() => new Spline(columnsSeen, rowsSeen, times));
      const {wide, high} = this.splines[0];
      Object.assign(this.picture, {width: wide, height: high});
      this.image = new ImageData(wide, high);
      this.bands = new Int8Array(wide * high);
    }
    const {wide, high} = this.splines[0];
    return {column, row, times, wide, high};
  }

  /** What is drawn, at each point of the part [kPa]. */
  #values(model, nodes, rounds, {column, row, times, wide, high}) {
    const [first] = this.splines, start = row * model.columns + column;
    if (rounds.length === 0) return first.update(nodes, 1, start, model.columns);
    const beside_kPa = forcesBeside(rounds, model).map((force) => (1e3 * force) / model.mean_area_mm2);
    for (const axis of components[this.quantity]) this.splines[axis].update(beside_kPa, 3, 3 * start + axis, model.columns);
    const [x_kPa, y_kPa, z_kPa] = this.splines.map(({values}) => values), sum = [0, 0, 0], make = made[this.quantity];
    const values = this.whole?.length === x_kPa.length ? this.whole : (this.whole = new Float32Array(x_kPa.length));
    const [from, step] = this.#placed(model, column, row, times);
    for (let v = 0, i = 0; v < high; ++v) {
      for (let u = 0; u < wide; ++u, ++i) {
        sum[0] = x_kPa[i];
        sum[1] = y_kPa[i];
        sum[2] = z_kPa[i];
        for (const contact of rounds) addMeanTraction(contact, from[0] + step * u, from[1] + step * v, 1.5 * step, sum);
        values[i] = make(sum);
      }
    }
    return values;
  }

  /** Where the node of a column and a row is, and how far apart points are of which there are so many for each [mm]. */
  #placed({columns, rows, description: {nodes: {pitch_m, centre_m}}}, column, row, times = 1) {
    return [[[column, columns], [row, rows]].map(([at, count], axis) => 1e3 * (centre_m[axis] + pitch_m * (at - (count - 1) / 2))), (1e3 * pitch_m) / times];
  }

  /** The edge, the nodes, and millimetres. */
  #axes(context, model, left, low, zoom, edge) {
    const {pitch_m, centre_m, columns, rows} = model.description.nodes;
    context.fillStyle = theme.grid;
    context.beginPath();
    const every = Math.ceil(Math.max(columns, rows) / mostDots);
    for (let row = 0; row < rows; row += every) {
      for (let column = 0; column < columns; column += every) {
        const u = left + zoom * column, v = low - zoom * row;
        if (u >= edge.left - 1 && u <= edge.right + 1 && v >= edge.top - 1 && v <= edge.low + 1) context.rect(u - 0.5, v - 0.5, 1, 1);
      }
    }
    context.fill();
    context.strokeStyle = theme.grid;
    context.lineWidth = 1;
    context.strokeRect(edge.left - 0.5, edge.top - 0.5, edge.right - edge.left + 1, edge.low - edge.top + 1);
    context.fillStyle = theme.quiet;
    context.font = "11px system-ui";
    context.textBaseline = "middle";
    const px_per_mm = zoom / (1e3 * pitch_m);
    const ticks = (centre_mm, count, put) => {
      const half = (1e3 * pitch_m * (count - 1)) / 2;
      const step = [1, 2, 5, 10, 20, 50, 100].find((one) => one * px_per_mm >= 30) ?? 200;
      for (let at = Math.ceil((centre_mm - half) / step) * step; at <= centre_mm + half; at += step) {
        put(px_per_mm * (at - centre_mm + half), String(at).replace("-", "−"));
      }
    };
    context.textAlign = "center";
    ticks(1e3 * centre_m[0], columns, (at, text) => {
      if (left + at < edge.left || left + at > edge.right) return;
      context.fillRect(left + at, edge.low + 1, 1, 4);
      context.fillText(text, left + at, edge.low + 13);
    });
    context.textAlign = "right";
    ticks(1e3 * centre_m[1], rows, (at, text) => {
      if (low - at < edge.top || low - at > edge.low) return;
      context.fillRect(edge.left - 5, low - at, 4, 1);
      context.fillText(text, edge.left - 8, low - at);
    });
    context.textAlign = "left";
    context.fillText("mm", edge.right + 6, edge.low + 13);
  }

  /** What the colours mean: a pressure, and the force of a node that has it. @param area_mm2 of a node; 0: without that */
  #bar(context, left, top, tall, full, area_mm2) {
    const steps = levels + 1;
    for (let k = 0; k < steps; ++k) {
      context.fillStyle = `rgb(${this.colours[k].join(" ")})`;
      context.fillRect(left, top + (tall * (steps - 1 - k)) / steps, bar_px, Math.ceil(tall / steps));
    }
    context.fillStyle = theme.quiet;
    context.font = "11px system-ui";
    context.textAlign = "left";
    for (let k = tall > 150 ? 2 : 5; k <= steps; k += tall > 150 ? 2 : 5) {
      const y = top + tall * (1 - k / steps), value = (k * full) / steps;
      context.fillText(pascals(value, full), left + bar_px + 5, y);
      if (area_mm2 > 0) context.fillText(newtons(1e-3 * value * area_mm2), left + bar_px + 58, y);
    }
    if (area_mm2 > 0) context.fillText("a node", left + bar_px + 58, top + tall - 1);
  }

  /** What is drawn at a place of the grid [kPa]; 0: nothing is. */
  #valueAt(values, part, x, y) {
    if (!part) return 0;
    const {column, row, times, wide, high} = part, c = (x - column) * times, r = (y - row) * times;
    return c >= 0 && r >= 0 && c < wide && r < high ? between(values, wide, high, c, r) : 0;
  }

  #underPointer(context, model, values, part, {left, low, zoom, edge}) {
    model.pointed = null;
    if (!this.#pointer) return;
    const [u, v] = this.#pointer, x = (u - left) / zoom, y = (low - v) / zoom;
    if (!(u >= edge.left && v >= edge.top && u <= edge.right && v <= edge.low)) return;
    const [at_mm, pitch_mm] = this.#placed(model, x, y), make = made[this.quantity];
    const node = Math.round(y) * model.columns + Math.round(x), deviation = model.shown.node_deviation_N;
    const over = model.rounds.filter((contact) => Math.hypot(at_mm[0] - contact.at[0], at_mm[1] - contact.at[1]) < contact.radius + contact.deviations.radius);
    const at = this.#valueAt(values, part, x, y), kPa = this.quantity === "pressure" ? at : Math.max(0, at);  // a spline may go below what it goes through
    const ofNode = deviation.length > 0 ? (1e3 * deviation[3 * node + (this.quantity === "shear" ? 0 : 2)]) / model.area_mm2(node) : 0;
    const deviation_kPa = over.length > 0 ? Math.hypot(...over.map((contact) => deviationAt(contact, ...at_mm, make))) : ofNode;
    const digits = kPa < 10 ? 2 : 1;
    const text = `${show(kPa, digits)} ${spread(deviation_kPa, digits)} kPa at ${at_mm.map((one) => show(one, 1)).join(", ")} mm`;
    model.pointed = {kPa, deviation_kPa, at_mm, mm_per_px: pitch_mm / zoom, text};
    context.font = "12px system-ui";
    const long = context.measureText(text).width + 12, from = Math.min(Math.max(u - long / 2, 2), this.canvas.clientWidth - long - 2);
    const top = v > 40 ? v - 34 : v + 14;
    context.strokeStyle = theme.text;
    context.lineWidth = 1;
    context.strokeRect(u - 4, v - 4, 8, 8);
    context.fillStyle = theme.card;
    context.fillRect(from, top, long, 20);
    context.strokeStyle = theme.quiet;
    context.strokeRect(from + 0.5, top + 0.5, long, 20);
    context.fillStyle = theme.text;
    context.textAlign = "left";
    context.textBaseline = "middle";
    context.fillText(text, from + 6, top + 11);
  }

  #paint(values, full) {
    const steps = levels + 1, pixels = new Uint32Array(this.image.data.buffer);
    for (let i = 0; i < values.length; ++i) {
      const t = values[i] / full, band = Math.min(Math.max(Math.floor(t * steps), 0), steps - 1), [red, green, blue] = this.colours[band];
      this.bands[i] = band;
      pixels[i] = ((255 * Math.min(Math.max(14 * t - 0.12, 0), 1)) << 24) | (blue << 16) | (green << 8) | red;
    }
    this.picture.getContext("2d").putImageData(this.image, 0, 0);
  }

  #lines(context, values, {column, row, times, wide, high}, full, zoom) {
    const {bands} = this;
    context.strokeStyle = theme.isLight ? "rgba(20,30,34,.55)" : "rgba(255,255,255,.42)";
    context.lineWidth = 1 / zoom;
    context.beginPath();
    for (let y = 0; y + 1 < high; ++y) {
      for (let x = 0; x + 1 < wide; ++x) {
        const i = y * wide + x;
        const ba = bands[i], bb = bands[i + 1], bc = bands[i + wide + 1], bd = bands[i + wide];
        if (ba === bb && ba === bc && ba === bd) continue;
        const a = values[i], b = values[i + 1], c = values[i + wide + 1], d = values[i + wide];
        for (let k = Math.min(ba, bb, bc, bd) + 1; k <= Math.max(ba, bb, bc, bd); ++k) {
          const level = (k * full) / (levels + 1);
          const cut = [];
          if ((a < level) !== (b < level)) cut.push(x + (level - a) / (b - a), y);
          if ((b < level) !== (c < level)) cut.push(x + 1, y + (level - b) / (c - b));
          if ((d < level) !== (c < level)) cut.push(x + (level - d) / (c - d), y + 1);
          if ((a < level) !== (d < level)) cut.push(x, y + (level - a) / (d - a));
          for (let j = 0; j + 3 < cut.length; j += 4) {
            context.moveTo(column + cut[j] / times, row + cut[j + 1] / times);
            context.lineTo(column + cut[j + 2] / times, row + cut[j + 3] / times);
          }
        }
      }
    }
    context.stroke();
  }

  /**
   * Writes what the lines mean on them, upright: of each contact along the ray from its middle on which most find room.
   * @param taken boxes [left, top, right, low] that are written upon @returns what was written
   */
  #numbers(context, model, values, part, full, {left, low, zoom, edge}, taken) {
    const {column, row, times, wide, high} = part, steps = levels + 1, written = [], boxes = [...taken];
    const unit = pascals(full, full).split(" ")[1];
    context.font = `${label_px}px system-ui`;
    const texts = Array.from({length: steps}, (_, k) => pascals((k * full) / steps, full).split(" ")[0]);
    this.widths = this.widthsOf === texts[1] ? this.widths : texts.map((text) => context.measureText(text).width + 2 * gap_px);
    this.widthsOf = texts[1];
    const valueAt = (u, v) => this.#valueAt(values, part, (u - left) / zoom, (low - v) / zoom);
    /** Where the values fall below the levels on a ray. */
    const falls = (u, v, angle) => {
      const found = [];
      let before = (steps * valueAt(u, v)) / full;
      for (let away = 1; away < farthest_px; ++away) {
        const now = (steps * valueAt(u + away * Math.cos(angle), v + away * Math.sin(angle))) / full;
        if (found.length > 0 && now > before + 0.2) break;  // of another contact
        for (let k = Math.min(Math.ceil(before) - 1, levels); k > now; --k) {
          const at = away - 1 + (before - k) / (before - now);
          found.push({k, u: u + at * Math.cos(angle), v: v + at * Math.sin(angle)});
        }
        if (now < 0.5 && found.length > 0) break;
        before = now;
      }
      return found;
    };
    /** Those for which there is room: those of the bar first. */
    const fitted = (found) => {
      const kept = [];
      for (const odd of [0, 1]) {
        for (const one of found) {
          if (one.k < 1 || one.k % 2 !== odd) continue;
          const half = this.widths[one.k] / 2, box = [one.u - half, one.v - label_px / 2 - 1, one.u + half, one.v + label_px / 2 + 1];
          if (box[0] < edge.left || box[1] < edge.top || box[2] > edge.right || box[3] > edge.low) continue;
          const isFree = (other) => box[0] > other[2] + gap_px || box[2] < other[0] - gap_px || box[1] > other[3] + gap_px || box[3] < other[1] - gap_px;
          if (boxes.every(isFree) && kept.every(({box: other}) => isFree(other))) kept.push({...one, box});
        }
      }
      return kept;
    };
    const strongest = () => {  // of a body, whose nodes lie in no plane
      let best = 0;
      for (let i = 1; i < values.length; ++i) if (values[i] > values[best]) best = i;
      return [column + (best % wide) / times, row + Math.floor(best / wide) / times];
    };
    const middles = model.description.body ? [strongest()] : model.shown.contacts.map(({position_m}) => model.gridPlace(position_m));
    context.textAlign = "center";
    context.textBaseline = "middle";
    middles.forEach(([x, y], i) => {
      const rays = angles.map((angle) => fitted(falls(left + zoom * x, low - zoom * y, angle))), counts = rays.map((ray) => ray.length);
      const most = counts.indexOf(Math.max(...counts)), before = this.#turns[i] ?? most;
      this.#turns[i] = counts[most] > counts[before] + 1 ? most : before;  // they stay where they are
      for (const {k, u, v, box} of rays[this.#turns[i]]) {
        const [red, green, blue] = this.colours[k];
        context.fillStyle = `rgb(${red} ${green} ${blue})`;
        context.fillRect(box[0], box[1], box[2] - box[0], box[3] - box[1]);
        context.fillStyle = 0.3 * red + 0.59 * green + 0.11 * blue > 110 ? "#0b1013" : "#ffffff";
        context.fillText(texts[k], u, v + 0.5);
        boxes.push(box);
        written.push({kPa: (k * full) / steps, text: texts[k], unit, box});
      }
    });
    return written;
  }
}
