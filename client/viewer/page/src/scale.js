// How long an arrow is: steps of 1, 2, 5, that change seldom; and values between those of a grid.

const steps = [1, 2, 5];
const fade_ms = 2300;  // until what was large counts half

export class Scale {
  /** @param least the largest value is never taken as smaller */
  constructor(least) {
    this.least = least;
    this.full = least;
    this.held = least;
    this.at = 0;
  }

  /** @param value the largest of now @returns the value of a full arrow or colour */
  update(value) {
    const now = performance.now();
    this.held = Math.max(value, this.held * 0.5 ** ((now - this.at) / fade_ms), this.least);
    this.at = now;
    const decade = 10 ** Math.floor(Math.log10(this.held));
    const nice = (steps.find((step) => step * decade >= this.held * 0.999) ?? 10) * decade;
    if (nice > this.full || nice < 0.45 * this.full) this.full = nice;
    return this.full;
  }
}

export function newtons(value) {
  return value >= 1 ? `${Number(value.toPrecision(2))} N` : `${Number((1e3 * value).toPrecision(2))} mN`;
}

/** @param of the value whose unit it has */
export function pascals(kPa, of = kPa) {
  const [unit, times] = of >= 1000 ? ["MPa", 1e-3] : of >= 1 ? ["kPa", 1] : ["Pa", 1e3];
  return `${Number((times * kPa).toPrecision(2))} ${unit}`;
}

/** The value at a place of a grid, [column, row], between those around it, or beyond those at its edge. @param size of each of `values` */
export function between(values, columns, rows, x, y, size = 1, axis = 0) {
  const c = Math.min(Math.max(Math.floor(x), 0), columns - 2), r = Math.min(Math.max(Math.floor(y), 0), rows - 2), s = x - c, t = y - r;
  const i = size * (r * columns + c) + axis, j = i + size * columns;
  return (1 - t) * ((1 - s) * values[i] + s * values[i + size]) + t * ((1 - s) * values[j] + s * values[j + size]);
}
