// The last 20 s, with a band of two standard deviations where one is known.
import uPlot from "uplot";

import {deviations} from "./model.js";
import {onTheme, theme} from "./theme.js";

const span_s = 20;
const finest_ms = 35;  // between points

const kinds = {
  force: {unit: "N", read: (field) => [field.resultant_N, deviations(field.resultant_covariance_N2)]},
  moment: {unit: "N mm", read: (field) => [field.moment_Nm.map((one) => 1e3 * one),
                                           deviations(field.moment_covariance_N2m2).map((one) => 1e3 * one)]},
  contact: {unit: "N", read: ({contacts: [first]}) => [first?.force_N ?? [null, null, null], first?.force_deviation_N ?? [0, 0, 0]]},
};

/** Of one sensor. */
export class History {
  constructor() {
    this.rows = {};
    for (const kind of Object.keys(kinds)) this.rows[kind] = Array.from({length: 10}, () => []);
    this.last = -Infinity;
  }

  add(field) {
    const now = performance.now();
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
      if (rows[0][0] < now / 1e3 - 1.5 * span_s) {
        const gone = rows[0].findIndex((time) => time > now / 1e3 - span_s - 1);
        for (const row of rows) row.splice(0, gone);
      }
    }
  }
}

export class Plot {
  constructor(element) {
    this.element = element;
    this.kind = "force";
    onTheme(() => this.#make());
    new ResizeObserver(() => this.plot?.setSize(this.#size())).observe(element);
    this.#make();
  }

  choose(kind) {
    this.kind = kind;
    this.#make();
  }

  #size() {
    return {width: Math.max(100, this.element.clientWidth), height: Math.max(80, this.element.clientHeight)};
  }

  #make() {
    this.plot?.destroy();
    const axis = {stroke: theme.quiet, grid: {stroke: theme.line, width: 1}, ticks: {show: false}, font: "11px system-ui"};
    const colours = [theme.x, theme.y, theme.z];
    this.plot = new uPlot({
      ...this.#size(),
      padding: [8, 18, 0, 0],
      cursor: {show: false},
      legend: {show: false},
      scales: {x: {time: false, auto: false}, y: {range: (_, low, high) => {
        const middle = 0.5 * (low + high), half = Math.max(0.55 * (high - low), this.kind === "moment" ? 0.5 : 0.02);
        return [middle - half, middle + half];
      }}},
      axes: [{...axis, size: 24, splits: ({scales: {x: {max}}}) => [-20, -15, -10, -5, 0].map((one) => max + one),
              values: () => ["−20 s", "−15", "−10", "−5", "now"]},
             {...axis, size: 52, values: (_, splits) => splits.map((one) => String(Number(one.toPrecision(3))).replace("-", "−"))}],
      series: [{}, ...["x", "y", "z"].map((label, i) => ({label, stroke: colours[i], width: 1.5, points: {show: false}})),
               ...Array.from({length: 6}, () => ({width: 0, points: {show: false}}))],
      bands: colours.map((colour, i) => ({series: [7 + i, 4 + i], fill: colour + "38"})),
    }, Array.from({length: 10}, () => []), this.element);
    const drawn = this.element.querySelector(".u-wrap");
    drawn.setAttribute("role", "img");
    drawn.setAttribute("aria-label", `${this.kind} in ${kinds[this.kind].unit}`);
  }

  draw(history) {
    const rows = history.rows[this.kind];
    const now = rows[0].at(-1);
    if (now === undefined) return;
    this.plot.setData(rows, false);
    this.plot.batch(() => {
      this.plot.setScale("x", {min: now - span_s, max: now});
    });
  }
}
