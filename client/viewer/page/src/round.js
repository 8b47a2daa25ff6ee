// What the model of a small contact says between the nodes: where the field describes it as one round patch, it presses as a
// ball does (Hertz, 1882), and its shear follows that pressure (docs/mathematics.md, 4.4). Millimetres, newtons.
const leastSpread = 0.02, blur = 0.08;  // of a patch among the nodes [node distances^2], as in daemon/solve/patch_spread.cpp
const beyond = 2;  // points outside the outermost nodes, whose forces these have
const steps = 20, precise = 1e-6, leastSlope = 0.1;
const fine = 4;  // places along a side of such a square
const vague = 0.25, stillKnown = 0.4;  // of the radius: a deviation from which on it is not known, and where it was known before

/** A point of the gel frame [m], as column and row. */
export function gridPlace({columns, rows, description: {nodes: {pitch_m, centre_m}}}, [x_m, y_m]) {
  return [(x_m - centre_m[0]) / pitch_m + (columns - 1) / 2, (y_m - centre_m[1]) / pitch_m + (rows - 1) / 2];
}

/** The round contacts of a field. Of a body there are none. @param before those of an earlier field, which stay a little longer than they come */
export function roundContacts({contacts}, {body}, before = []) {
  const most = ([x_m, y_m]) => (before.some(({at: [x, y], radius}) => Math.hypot(1e3 * x_m - x, 1e3 * y_m - y) < radius) ? stillKnown : vague);
  return body ? [] : contacts.filter(({hertz_radius_m: radius, hertz_radius_deviation_m: deviation, position_m}) =>
    radius > 0 && deviation < most(position_m) * radius).map((contact) => ({
    at: contact.position_m.map((one) => 1e3 * one), radius: 1e3 * contact.hertz_radius_m, force: contact.force_N, torque: 1e3 * contact.moment_Nm[2],
    deviations: {at: contact.position_deviation_m.map((one) => 1e3 * one), radius: 1e3 * contact.hertz_radius_deviation_m, force: contact.force_deviation_N},
  }));
}

/** Adds a contact's traction at a place, times a weight, to `sum` [kPa]: x, y, z. */
export function addTraction({at, radius, force, torque}, x, y, sum, weight = 1) {
  const dx = x - at[0], dy = y - at[1], inner = 1 - (dx * dx + dy * dy) / radius ** 2;
  if (inner <= 0) return;
  const share = (1.5e3 * weight * Math.sqrt(inner)) / (Math.PI * radius ** 2), turn = torque / (0.4 * radius ** 2);
  sum[0] += share * (force[0] - turn * dy);
  sum[1] += share * (force[1] + turn * dx);
  sum[2] += share * force[2];
}

/** The same as a mean over a square of that side around the place, where the rim is near: it is steep there, and lines would be jagged. */
export function addMeanTraction(contact, x, y, side, sum) {
  const {at, radius} = contact;
  if (Math.abs(Math.hypot(x - at[0], y - at[1]) - radius) > side) return addTraction(contact, x, y, sum);
  for (let i = 0; i < fine ** 2; ++i) {
    addTraction(contact, x + side * (((i % fine) + 0.5) / fine - 0.5), y + side * ((Math.floor(i / fine) + 0.5) / fine - 0.5), sum, 1 / fine ** 2);
  }
}

/** Standard deviation of a number that is made of a contact's traction at a place. @param made of the three components */
export function deviationAt(contact, x, y, made) {
  const {deviations} = contact, valueOf = (change) => {
    const sum = [0, 0, 0];
    addTraction({...contact, ...change}, x, y, sum);
    return made(sum);
  };
  let squares = 0;
  const by = (change) => { squares += ((valueOf(change(1)) - valueOf(change(-1))) / 2) ** 2; };
  by((sign) => ({radius: contact.radius + sign * deviations.radius}));
  for (const name of ["at", "force"]) {
    deviations[name].forEach((deviation, axis) => by((sign) => ({[name]: contact[name].map((one, k) => (k === axis ? one + sign * deviation : one))})));
  }
  return Math.sqrt(squares);
}

/** Shares of points side by side in a Gaussian whose centroid is at `at`, the points beyond the outermost counting as these. */
function sharesAlong(at, variance, count) {
  const share = new Float64Array(count);
  for (let step = 0, centre = at; ; ++step) {
    let sum = 0, first = 0, second = 0;
    share.fill(0);
    for (let i = -beyond; i < count + beyond; ++i) {
      const away = i - centre, weight = Math.exp(-(away ** 2) / (2 * variance));
      share[Math.min(Math.max(i, 0), count - 1)] += weight;
      sum += weight;
      first += away * weight;
      second += away ** 2 * weight;
    }
    const off = at - (centre + first / sum);
    if (Math.abs(off) < precise || step === steps) return share.map((one) => one / sum);
    centre = Math.min(Math.max(centre + off / Math.max((second / sum - (first / sum) ** 2) / variance, leastSlope), at - 0.5), at + 0.5);
  }
}

/** Calls use(node, share) for each node that the field gave a part of a contact's force. */
function eachShare({at, radius}, model, use) {
  const {columns, rows} = model, pitch = 1e3 * model.description.nodes.pitch_m, place = gridPlace(model, at.map((one) => 1e-3 * one));
  const variance = Math.max((0.2 * radius ** 2) / pitch ** 2, leastSpread) + blur;
  const [across, up] = [columns, rows].map((count, axis) => sharesAlong(Math.min(Math.max(place[axis], -beyond), count - 1 + beyond), variance, count));
  for (let row = 0; row < rows; ++row) {
    for (let column = 0; column < columns; ++column) {
      const share = across[column] * up[row];
      if (share > 1e-6) use(row * columns + column, share);
    }
  }
}

/** The nodes' forces without those of the round contacts [N]: x, y, z of each. */
export function forcesBeside(contacts, model) {
  const rest = Float32Array.from(model.shown.force_N), {positions_mm: place} = model;
  for (const contact of contacts) {
    const {at, force, torque} = contact;
    let spread = 0;
    eachShare(contact, model, (node, share) => { spread += share * ((place[3 * node] - at[0]) ** 2 + (place[3 * node + 1] - at[1]) ** 2); });
    eachShare(contact, model, (node, share) => {
      const turn = torque / spread;
      rest[3 * node] -= share * (force[0] - turn * (place[3 * node + 1] - at[1]));
      rest[3 * node + 1] -= share * (force[1] + turn * (place[3 * node] - at[0]));
      rest[3 * node + 2] -= share * force[2];
    });
  }
  return rest;
}

/** How a half space's surface moves inwards under forces that press on it [mm]: under those of the nodes, each even on its
    square, as the viewer computes it, and under a ball. */
export class PressedSurface {
  #key = "";

  #prepare({columns, rows, description: {nodes: {pitch_m}, gel}}) {
    const key = [columns, rows, pitch_m, gel.poisson_ratio, gel.youngs_modulus_Pa].join(" ");
    if (key === this.#key) return;
    this.#key = key;
    this.perNewton = (1e6 * (1 - gel.poisson_ratio ** 2)) / (Math.PI * gel.youngs_modulus_Pa);  // [mm^2]: times 1 / distance
    this.squares = new Float64Array(columns * rows);  // by columns and rows that two nodes lie apart
    const pitch = 1e3 * pitch_m, scale = this.perNewton / pitch;
    const corner = (x, y) => { const r = Math.hypot(x, y); return x * Math.log(y + r) + y * Math.log(x + r); };
    for (let row = 0; row < rows; ++row) {
      for (let column = 0; column < columns; ++column) {
        this.squares[row * columns + column] = scale * (corner(column + 0.5, row + 0.5) - corner(column - 0.5, row + 0.5) -
          corner(column + 0.5, row - 0.5) + corner(column - 0.5, row - 0.5));
      }
    }
  }

  /** The motion inwards at the nodes without what the contacts' forces there do. */
  beside(contacts, model) {
    this.#prepare(model);
    const {columns, rows, displacement_mm: moved} = model, rest = new Float32Array(columns * rows);
    for (let i = 0; i < rest.length; ++i) rest[i] = moved[3 * i + 2];
    for (const contact of contacts) {
      eachShare(contact, model, (node, share) => {
        const force = share * contact.force[2], c = node % columns, r = Math.floor(node / columns);
        for (let row = 0, i = 0; row < rows; ++row) {
          const from = Math.abs(row - r) * columns;
          for (let column = 0; column < columns; ++column, ++i) rest[i] -= force * this.squares[from + Math.abs(column - c)];
        }
      });
    }
    return rest;
  }

  /** Under a ball's contact, at a place (Johnson, Contact Mechanics, 1985, 3.42). */
  under({at, radius, force}, x, y) {
    const away = Math.sqrt((x - at[0]) ** 2 + (y - at[1]) ** 2) / radius, scale = (0.75 * this.perNewton * force[2]) / radius;
    if (away < 1) return 0.5 * Math.PI * scale * (2 - away * away);
    return scale * ((2 - away * away) * Math.asin(1 / away) + Math.sqrt(away * away - 1));
  }
}
