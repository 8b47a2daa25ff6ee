// The last ten minutes of force, moment or first contact, with a band of two standard deviations where one is known, and marks
// where a zero was taken, contacts began and ended, and flags came. A part is looked at by dragging; a double click returns.
import uPlot from "uplot";

import {deviations} from "./model.js";
import {flagWords, show} from "./numbers.js";
import {onTheme, theme} from "./theme.js";

const longest_s = 600;
const finest_ms = 35;  // between points
const axes = ["x", "y", "z"];
const shortest_s = 0.2;  // that can be looked at
const again_s = 30;  // before a flag is marked once more

const kinds = {
  force: {unit: "N", digits: 3, read: (field) => [field.resultant_N, deviations(field.resultant_covariance_N2)]},
  moment: {unit: "N mm", digits: 2, read: (field) => [field.moment_Nm.map((one) => 1e3 * one),
                                                      deviations(field.moment_covariance_N2m2).map((one) => 1e3 * one)]},
  contact: {unit: "N", digits: 3, read: ({contacts: [first]}) => [first?.force_N ?? [null, null, null], first?.force_deviation_N ?? [0, 0, 0]]},
};

/** Of one sensor. Times are the page's [s]. */
export class History {
  constructor() {
    this.rows = {};
    for (const kind of Object.keys(kinds)) this.rows[kind] = Array.from({length: 10}, () => []);
    this.marks = [];  // {at_s, text}
    this.flagged = new Map();  // when a flag was there last [s]
    this.last = -Infinity;
  }

  mark(text) {
    this.marks.push({at_s: performance.now() / 1e3, text});
  }

  /** Joins what was and what comes by no line. */
  interrupt() {
    for (const rows of Object.values(this.rows)) {
      if (rows[1].at(-1) == null) continue;
      rows.forEach((row, i) => row.push(i === 0 ? performance.now() / 1e3 : null));
    }
  }

  add(field) {
    const contacts = field.valid ? field.contacts.length : this.contacts, flags = field.header.flags;
    if (this.contacts !== undefined && (contacts > 0) !== (this.contacts > 0)) this.mark(contacts > 0 ? "contact" : "free");
    const now = performance.now();
    for (const flag of flags) {
      if (now / 1e3 - (this.flagged.get(flag) ?? -Infinity) > again_s) this.mark(flagWords[flag] ?? flag);
      this.flagged.set(flag, now / 1e3);
    }
    this.contacts = contacts;
    if (now - this.last < finest_ms || !field.valid) return;
    this.last = now;
    for (const [kind, {read}] of Object.entries(kinds)) {
      const rows = this.rows[kind];
      const [values, spread] = read(field);
      rows[0].push(now / 1e3);
      for (let axis = 0; axis < 3; ++axis) {
        const value = values[axis];
        rows[1 + axis].push(value);
        rows[4 + axis].push(value === null ? null : value - 2 * spread[axis]);
        rows[7 + axis].push(value === null ? null : value + 2 * spread[axis]);
      }
      if (rows[0][0] < now / 1e3 - 1.1 * longest_s) {
        const gone = rows[0].findIndex((time) => time > now / 1e3 - longest_s);
        for (const row of rows) row.splice(0, gone);
      }
    }
    while (this.marks[0]?.at_s < now / 1e3 - longest_s) this.marks.shift();
  }
}

const clock = (seconds) => (Math.abs(seconds) < 90 ? `${show(seconds, Math.abs(seconds) < 5 ? 2 : 1)} s` : `${show(seconds / 60, 1)} min`);

export class Plot {
  /** @param values element for what is under the cursor */
  constructor(element, values) {
    Object.assign(this, {element, values, kind: "force", span_s: 20, part: null, marks: []});
    onTheme(() => this.#make());
    new ResizeObserver(() => this.plot?.setSize(this.#size())).observe(element);
    element.addEventListener("dblclick", () => { this.part = null; });
    this.#make();
  }

  choose(kind) {
    this.kind = kind;
    this.#make();
  }

  look(span_s) {
    this.span_s = span_s;
    this.part = null;
  }

  #size() {
    return {width: Math.max(100, this.element.clientWidth), height: Math.max(80, this.element.clientHeight)};
  }

  #make() {
    this.plot?.destroy();
    const axis = {stroke: theme.quiet, grid: {stroke: theme.line, width: 1}, ticks: {show: false}, font: "11px system-ui"};
    const colours = axes.map((name) => theme[name]);
    this.plot = new uPlot({
      ...this.#size(),
      padding: [8, 18, 0, 0],
      cursor: {y: false, points: {size: 6}, drag: {setScale: false, x: true, y: false}},
      legend: {show: false},
      scales: {x: {time: false, auto: false}, y: {range: (_, low, high) => {
        const middle = 0.5 * (low + high), half = Math.max(0.55 * (high - low), this.kind === "moment" ? 0.5 : 0.02);
        return [middle - half, middle + half];
      }}},
      axes: [{...axis, size: 24, splits: ({scales: {x: {min, max}}}) => this.#ticks(min, max),
              values: (_, splits) => splits.map((one) => (Math.abs(this.now - one) < 1e-3 ? "now" : clock(one - this.now).replace(/\.0+ /, " ")))},
             {...axis, size: 52, values: (_, splits) => splits.map((one) => String(Number(one.toPrecision(3))).replace("-", "−"))}],
      series: [{}, ...axes.map((label, i) => ({label, stroke: colours[i], width: 1.5, points: {show: false}})),
               ...Array.from({length: 6}, () => ({width: 0, points: {show: false}}))],
      bands: colours.map((colour, i) => ({series: [7 + i, 4 + i], fill: colour + "38"})),
      hooks: {
        draw: [(plot) => this.#drawMarks(plot)],
        setCursor: [({cursor: {idx}}) => this.#tell(idx)],
        setSelect: [(plot) => {
          const {left, width} = plot.select;
          const [from, to] = [left, left + width].map((px) => plot.posToVal(px, "x"));
          plot.setSelect({left: 0, width: 0}, false);
          if (to - from >= shortest_s) this.part = [from, to];
        }],
      },
    }, Array.from({length: 10}, () => []), this.element);
    const drawn = this.element.querySelector(".u-wrap");
    drawn.setAttribute("role", "img");
    drawn.setAttribute("aria-label", `${this.kind} in ${kinds[this.kind].unit}`);
  }

  /** From now backwards, in round steps. */
  #ticks(min, max) {
    const rough = (max - min) / 5, step = [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 30, 60, 120].find((one) => one >= rough) ?? 240, ticks = [];
    for (let k = Math.ceil((this.now - max) / step - 1e-6); this.now - k * step >= min - 1e-6; ++k) ticks.push(this.now - k * step);
    return ticks.reverse();
  }

  #tell(index) {
    const {unit, digits} = kinds[this.kind], [times, ...rows] = this.plot.data;
    const text = index == null || times[index] === undefined ? "" : `${clock(times[index] - this.now)}: ${axes.map((axis, i) =>
      `${axis} ${rows[i][index] === null ? "–" : show(rows[i][index], digits)}`).join("  ")} ${unit}`;
    if (this.values.textContent !== text) this.values.textContent = text;
  }

  #drawMarks({ctx: context, bbox: {left, top, width, height}, scales: {x}}) {
    context.save();
    context.font = `${11 * devicePixelRatio}px system-ui`;
    context.textAlign = "left";
    context.textBaseline = "alphabetic";
    context.fillStyle = context.strokeStyle = theme.quiet;
    context.setLineDash([3, 3]);
    let free = -Infinity;  // for a text, from here
    for (const {at_s, text} of this.marks) {
      if (!(at_s >= x.min && at_s <= x.max)) continue;
      const at = Math.round(left + (width * (at_s - x.min)) / (x.max - x.min)) + 0.5;
      context.beginPath();
      context.moveTo(at, top);
      context.lineTo(at, top + height);
      context.stroke();
      if (at < free || at + context.measureText(text).width > left + width) continue;
      context.fillText(text, at + 4, top + 11 * devicePixelRatio);
      free = at + context.measureText(text).width + 12;
    }
    context.restore();
  }

  draw(history) {
    const rows = history.rows[this.kind];
    this.now = rows[0].at(-1) ?? 0;
    this.marks = history.marks;
    this.plot.setData(rows, false);
    const [min, max] = this.part ?? [this.now - this.span_s, this.now];
    this.plot.batch(() => { this.plot.setScale("x", {min, max}); });
  }

  /** Rows of what is seen: time since its begin [s], then three values, and two standard deviations of each. */
  get #seen() {
    const {min, max} = this.plot.scales.x, [times, ...rows] = this.plot.data, seen = [];
    times.forEach((time, i) => {
      if (time < min || time > max || rows[0][i] === null) return;
      seen.push([time - min, ...[0, 1, 2].map((axis) => rows[axis][i]), ...[0, 1, 2].map((axis) => rows[6 + axis][i] - rows[axis][i])]);
    });
    return seen;
  }

  csv() {
    const unit = kinds[this.kind].unit.replace(" ", "_");
    const head = ["time_s", ...axes.map((axis) => `${this.kind}_${axis}_${unit}`), ...axes.map((axis) => `two_deviations_${axis}_${unit}`)];
    return [head, ...this.#seen.map((row) => row.map((one) => Number(one.toPrecision(7))))].map((row) => row.join(",")).join("\n") + "\n";
  }

  svg() {
    const wide = 800, high = 300, edge = 48, seen = this.#seen, {x, y} = this.plot.scales, {unit} = kinds[this.kind];
    const u = (time) => (edge + ((wide - 2 * edge) * time) / (x.max - x.min)).toFixed(1);
    const v = (value) => (high - edge - ((high - 2 * edge) * (value - y.min)) / (y.max - y.min)).toFixed(1);
    const text = (at, words, more = "") => `<text x="${at[0]}" y="${at[1]}" ${more}>${words}</text>`;
    const lines = axes.map((axis, i) => {
      const band = [...seen.map((row) => `${u(row[0])},${v(row[1 + i] + row[4 + i])}`),
        ...seen.toReversed().map((row) => `${u(row[0])},${v(row[1 + i] - row[4 + i])}`)].join(" ");
      return `<polygon points="${band}" fill="${theme[axis]}" opacity=".2"/><polyline fill="none" stroke="${theme[axis]}" points="${
        seen.map((row) => `${u(row[0])},${v(row[1 + i])}`).join(" ")}"/>${text([wide - edge + 8, 60 + 18 * i], axis, `fill="${theme[axis]}"`)}`;
    });
    const ticks = [0, 0.25, 0.5, 0.75, 1].map((share) => {
      const time = share * (x.max - x.min), value = y.min + share * (y.max - y.min);
      return text([u(time), high - edge + 18], `${Number(time.toPrecision(3))} s`, `text-anchor="middle"`) +
        text([edge - 6, v(value)], Number(value.toPrecision(3)), `text-anchor="end"`);
    });
    return `<svg xmlns="http://www.w3.org/2000/svg" width="${wide}" height="${high}" viewBox="0 0 ${wide} ${high}" font-family="sans-serif" font-size="12" fill="#444">` +
      `<rect width="${wide}" height="${high}" fill="white"/><rect x="${edge}" y="${edge}" width="${wide - 2 * edge}" height="${high - 2 * edge}" fill="none" stroke="#bbb"/>` +
      `${text([edge, edge - 14], `${this.kind} in ${unit}`)}${ticks.join("")}${lines.join("")}</svg>\n`;
  }
}
