// View c: how large the forces are, as filled contours of a spline surface through the nodes; and which nodes stick and slip.
import {fit, say} from "./canvas.js";
import {Scale, newtons} from "./scale.js";
import {drawStickSlip, gradient} from "./stick_slip.js";
import {rampAt, theme} from "./theme.js";
import {drawTouching} from "./touching.js";

const levels = 8;
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
  constructor(canvas, label, legend) {
    this.canvas = canvas;
    this.label = label;
    this.legend = legend;
    legend.querySelector("i").style.background = gradient;
    this.scale = new Scale(0.01);
    this.picture = document.createElement("canvas");
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
    const full = this.scale.update(model.largest_N);
    const {wide, high} = this.spline;
    const values = this.spline.update(model.magnitude_N);
    this.#paint(values, full);
    const margin = 14;
    const zoom = Math.min((width - 2 * margin) / (wide - 1), (height - 2 * margin) / (high - 1));
    context.save();
    context.translate((width - zoom * (wide - 1)) / 2, (height + zoom * (high - 1)) / 2);
    context.scale(zoom, -zoom);  // y is up
    context.imageSmoothingEnabled = true;
    context.drawImage(this.picture, -0.5, -0.5, wide, high);
    context.strokeStyle = theme.line;
    context.lineWidth = 1 / zoom;
    context.strokeRect(0, 0, wide - 1, high - 1);
    this.#lines(context, values, full, zoom);
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
    model.contours = {full_N: full, levels_N: Array.from({length: levels}, (_, i) => ((i + 1) * full) / (levels + 1))};
    say(this.label, `brightest ${newtons(full)} a node`);
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
