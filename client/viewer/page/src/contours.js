// View c: pressure, shear or both, as filled contours of a spline surface through the nodes; and which nodes stick and slip.
import {fit, say} from "./canvas.js";
import {show, spread} from "./numbers.js";
import {Scale, newtons, pascals} from "./scale.js";
import {drawStickSlip, gradient} from "./stick_slip.js";
import {rampAt, theme} from "./theme.js";
import {drawTouching} from "./touching.js";

const levels = 9;  // so that those of a scale of 1, 2 or 5 are round
const margin = {left: 34, top: 12, right: 76, bottom: 24};  // [px]
const wide_px = 420, second_px = 56;  // of a view that shows newtons beside pascals, and their column
const bar_px = 12;
const mostDots = 24;  // for nodes, along a side
const faded = 0.3;  // of the last touch
const finest = 93;  // points along a side, at most, of the spline that is drawn

/** Weights of four neighbours at t between the second and third (Catmull and Rom, 1974). */
function weights(t) {
  return [t * (t * (1 - 0.5 * t) - 0.5), 1 + t * t * (1.5 * t - 2.5), t * (0.5 + t * (2 - 1.5 * t)), 0.5 * t * t * (t - 1)];
}

/** A grid of numbers, finer: along rows, then along columns. */
export class Spline {
  constructor(columns, rows, times) {
    Object.assign(this, {columns, rows, times});
    this.wide = (columns - 1) * times + 1;
    this.high = (rows - 1) * times + 1;
    this.half = new Float32Array(this.wide * rows);
    this.values = new Float32Array(this.wide * this.high);
    this.weights = Array.from({length: times}, (_, i) => weights(i / times));
  }

  update(given, stride = 1, offset = 0) {
    const {columns, rows, times, wide, high, half, values} = this;
    for (let r = 0; r < rows; ++r) {
      for (let x = 0; x < wide; ++x) {
        const c = Math.floor(x / times), w = this.weights[x % times];
        let sum = 0;
        for (let k = 0; k < 4; ++k) {
          const at = Math.min(Math.max(c + k - 1, 0), columns - 1);
          sum += w[k] * given[(r * columns + at) * stride + offset];
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

  /** @param redraw is called when the pointer has moved */
  constructor(canvas, label, legend, redraw) {
    this.canvas = canvas;
    this.label = label;
    this.legend = legend;
    legend.querySelector("i").style.background = gradient;
    this.scale = new Scale(0.2);  // [kPa]
    this.picture = document.createElement("canvas");
    canvas.addEventListener("pointermove", ({offsetX, offsetY}) => { this.#pointer = [offsetX, offsetY]; redraw(); });
    canvas.addEventListener("pointerleave", () => { this.#pointer = null; redraw(); });
  }

  draw(model) {
    const fitted = fit(this.canvas);
    if (!fitted || !model.isComplete || model.columns < 2 || model.rows < 2) return;
    const {context, width, height} = fitted;
    const {columns, rows} = model;
    if (this.spline?.columns !== columns || this.spline?.rows !== rows) {
      const times = Math.max(1, Math.floor((finest - 1) / (Math.max(columns, rows) - 1)));
      this.spline = new Spline(columns, rows, times);
      this.picture.width = this.spline.wide;
      this.picture.height = this.spline.high;
      this.image = new ImageData(this.spline.wide, this.spline.high);
    }
    const nodes = model.pressures_kPa(this.quantity);
    let largest = 0;
    for (const one of nodes) if (one > largest) largest = one;
    const full = this.scale.update(largest);
    const {wide, high} = this.spline;
    const values = this.spline.update(nodes);
    this.#paint(values, full);
    const right = margin.right + (width > wide_px ? second_px : 0);
    const zoom = Math.max(0.1, Math.min((width - margin.left - right) / (wide - 1), (height - margin.top - margin.bottom) / (high - 1)));
    const left = Math.round((width - zoom * (wide - 1) - right + margin.left) / 2), low = margin.top + zoom * (high - 1);
    this.#axes(context, model, left, low, zoom);
    context.save();
    context.translate(left, low);
    context.scale(zoom, -zoom);  // y is up
    context.imageSmoothingEnabled = true;
    context.globalAlpha = model.isGhost ? faded : 1;
    context.drawImage(this.picture, -0.5, -0.5, wide, high);
    this.#lines(context, values, full, zoom);
    context.globalAlpha = 1;
    const place = (point) => this.#place(model, point);
    model.stick_slip = drawStickSlip(context, model, place);
    this.legend.hidden = model.stick_slip.length === 0;
    drawTouching(context, model, place);
    context.fillStyle = theme.text;
    for (const contact of model.tracked ? [] : model.field.contacts) {
      const [x, y] = this.#place(model, contact.position_m);
      context.beginPath();
      context.arc(x, y, 2.5 / zoom, 0, 7);
      context.fill();
    }
    context.restore();
    this.#bar(context, left + zoom * (wide - 1) + 18, margin.top, low - margin.top, full, width > wide_px ? model.mean_area_mm2 : 0);
    this.#underPointer(context, model, values, left, low, zoom);
    model.contours = {full_kPa: full, levels_kPa: Array.from({length: levels}, (_, i) => ((i + 1) * full) / (levels + 1))};
    say(this.label, model.ghostWords + (largest > 0 ? `most ${pascals(largest)}` :
      `nothing touches; a node is seen from ${newtons(model.description.solver.detection_limit_normal_N)}`));
  }

  /** The edge, the nodes, and millimetres. */
  #axes(context, model, left, low, zoom) {
    const {wide, high, times} = this.spline, {pitch_m, centre_m, columns, rows} = model.description.nodes;
    const right = left + zoom * (wide - 1), top = low - zoom * (high - 1);
    context.fillStyle = theme.grid;
    context.beginPath();
    const every = Math.ceil(Math.max(columns, rows) / mostDots);
    for (let row = 0; row < rows; row += every) {
      for (let column = 0; column < columns; column += every) context.rect(left + zoom * times * column - 0.5, low - zoom * times * row - 0.5, 1, 1);
    }
    context.fill();
    context.strokeStyle = theme.grid;
    context.lineWidth = 1;
    context.strokeRect(left - 0.5, top - 0.5, right - left + 1, low - top + 1);
    context.fillStyle = theme.quiet;
    context.font = "11px system-ui";
    context.textBaseline = "middle";
    const ticks = (centre_mm, count, put) => {
      const half = (1e3 * pitch_m * (count - 1)) / 2, px_per_mm = (zoom * times) / (1e3 * pitch_m);
      const step = [1, 2, 5, 10, 20, 50, 100].find((one) => one * px_per_mm >= 30) ?? 200;
      for (let at = Math.ceil((centre_mm - half) / step) * step; at <= centre_mm + half; at += step) {
        put((zoom * times * (at - centre_mm + half)) / (1e3 * pitch_m), String(at).replace("-", "−"));
      }
    };
    context.textAlign = "center";
    ticks(1e3 * centre_m[0], columns, (at, text) => {
      context.fillRect(left + at, low + 1, 1, 4);
      context.fillText(text, left + at, low + 13);
    });
    context.textAlign = "right";
    ticks(1e3 * centre_m[1], rows, (at, text) => {
      context.fillRect(left - 5, low - at, 4, 1);
      context.fillText(text, left - 8, low - at);
    });
    context.textAlign = "left";
    context.fillText("mm", right + 6, low + 13);
  }

  /** What the colours mean: a pressure, and the force of a node that has it. @param area_mm2 of a node; 0: without that */
  #bar(context, left, top, tall, full, area_mm2) {
    const steps = levels + 1;
    for (let k = 0; k < steps; ++k) {
      context.fillStyle = `rgb(${this.colours[k].map(Math.round).join(" ")})`;
      context.fillRect(left, top + (tall * (steps - 1 - k)) / steps, bar_px, Math.ceil(tall / steps));
    }
    context.fillStyle = theme.quiet;
    context.textAlign = "left";
    for (let k = tall > 150 ? 2 : 5; k <= steps; k += tall > 150 ? 2 : 5) {
      const y = top + tall * (1 - k / steps), value = (k * full) / steps;
      context.fillText(pascals(value), left + bar_px + 5, y);
      if (area_mm2 > 0) context.fillText(newtons(1e-3 * value * area_mm2), left + bar_px + 58, y);
    }
    if (area_mm2 > 0) context.fillText("a node", left + bar_px + 58, top + tall - 1);
  }

  #underPointer(context, model, values, left, low, zoom) {
    model.pointed = null;
    if (!this.#pointer) return;
    const {wide, high, times} = this.spline, [u, v] = this.#pointer, x = (u - left) / zoom, y = (low - v) / zoom;
    if (!(x >= 0 && y >= 0 && x <= wide - 1 && y <= high - 1)) return;
    const {pitch_m, centre_m, columns, rows} = model.description.nodes;
    const at_mm = [[x, columns, 0], [y, rows, 1]].map(([at, count, axis]) => 1e3 * (centre_m[axis] + pitch_m * (at / times - (count - 1) / 2)));
    const node = Math.round(y / times) * columns + Math.round(x / times), deviation = model.shown.node_deviation_N;
    const axis = this.quantity === "shear" ? 0 : 2, at = values[Math.round(y) * wide + Math.round(x)];
    const kPa = this.quantity === "pressure" ? at : Math.max(0, at);  // a spline may go below what it goes through
    const digits = kPa < 10 ? 2 : 1, doubt = deviation.length > 0 ? spread(1e3 * deviation[3 * node + axis] / model.area_mm2(node), digits) : "";
    model.pointed = {kPa, at_mm, mm_per_px: (1e3 * pitch_m) / (times * zoom), text: `${show(kPa, digits)} ${doubt} kPa at ${at_mm.map((one) => show(one, 1)).join(", ")} mm`};
    context.font = "12px system-ui";
    const long = context.measureText(model.pointed.text).width + 12, from = Math.min(Math.max(u - long / 2, 2), this.canvas.clientWidth - long - 2);
    const over = v > 40 ? v - 34 : v + 14;
    context.strokeStyle = theme.text;
    context.strokeRect(u - 4, v - 4, 8, 8);
    context.fillStyle = theme.card;
    context.fillRect(from, over, long, 20);
    context.strokeStyle = theme.quiet;
    context.strokeRect(from + 0.5, over + 0.5, long, 20);
    context.fillStyle = theme.text;
    context.textAlign = "left";
    context.fillText(model.pointed.text, from + 6, over + 11);
  }

  #place(model, [x_m, y_m]) {
    const {pitch_m, centre_m, columns, rows} = model.description.nodes;
    const {times} = this.spline;
    return [times * ((x_m - centre_m[0]) / pitch_m + (columns - 1) / 2), times * ((y_m - centre_m[1]) / pitch_m + (rows - 1) / 2)];
  }

  #paint(values, full) {
    const {data} = this.image;
    const steps = levels + 1;
    this.colours ??= Array.from({length: steps}, (_, k) => rampAt(0.12 + (0.88 * (k + 0.5)) / steps).map((one) => 255 * one));
    if (this.bands?.length !== values.length) this.bands = new Int8Array(values.length);
    for (let i = 0; i < values.length; ++i) {
      const t = values[i] / full;
      const band = Math.min(Math.max(Math.floor(t * steps), 0), steps - 1);
      this.bands[i] = band;
      const opacity = 14 * t - 0.12;
      if (opacity <= 0) {
        data[4 * i + 3] = 0;
        continue;
      }
      const colour = this.colours[band];
      data[4 * i] = colour[0];
      data[4 * i + 1] = colour[1];
      data[4 * i + 2] = colour[2];
      data[4 * i + 3] = 255 * Math.min(1, opacity);
    }
    this.picture.getContext("2d").putImageData(this.image, 0, 0);
  }

  #lines(context, values, full, zoom) {
    const {wide, high} = this.spline, {bands} = this;
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
            context.moveTo(cut[j], cut[j + 1]);
            context.lineTo(cut[j + 2], cut[j + 3]);
          }
        }
      }
    }
    context.stroke();
  }
}
