// The touched face as the views in three dimensions draw it: a lit spline through the nodes, moved as the forces move it.
import {BufferAttribute, BufferGeometry, Color, DoubleSide, DynamicDrawUsage, Group, LineBasicMaterial, LineSegments, Mesh,
  MeshBasicMaterial, Vector3} from "three";

import {isSlow} from "./canvas.js";
import {Spline} from "./contours.js";
import {PressedSurface} from "./round.js";
import {sunlight} from "./scene.js";
import {onTheme, theme} from "./theme.js";

const finest = isSlow ? 47 : 93;  // points along a side, at most
const ambient = 0.54, diffuse = 0.54, gloss = 0.16, shininess = 48;
const mostLines = 12;  // of the grid along a side
const mostSideways = 3;  // times that motion along the surface is drawn larger

/** Of the nodes: of a body's they are not in a plane. */
export function extentOf(positions_mm) {
  const min = [Infinity, Infinity, Infinity], max = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < positions_mm.length; ++i) {
    min[i % 3] = Math.min(min[i % 3], positions_mm[i]);
    max[i % 3] = Math.max(max[i % 3], positions_mm[i]);
  }
  return {min, max};
}

export class Skin extends Group {
  /** @param isPale it is the ground for what stands on it */
  constructor(isPale = false) {
    super();
    this.material = new MeshBasicMaterial({vertexColors: true, side: DoubleSide, polygonOffset: true, polygonOffsetFactor: 1,
      polygonOffsetUnits: 1});  // lit point by point in update(), not pixel by pixel
    this.ink = new LineBasicMaterial({transparent: true, opacity: 0.28});
    this.sun = new Vector3(...sunlight);
    this.halfway = new Vector3();
    this.pressed = new PressedSurface();
    const colour = () => {
      this.rest = new Color(isPale ? (theme.isLight ? "#dde6e3" : "#2a3a40") : theme.isLight ? "#b9cfcb" : "#4b6d75").toArray();
      this.deep = new Color(theme.isLight ? "#c96a2b" : "#ffb25c").toArray();
      this.raised = new Color(theme.isLight ? "#2f78b7" : "#7cc4ff").toArray();
      this.ink.color.set(theme.isLight ? "#17343a" : "#0b1417");
    };
    onTheme(colour);
    colour();
  }

  #prepare({columns, rows, positions_mm}) {
    if (this.positions === positions_mm) return;
    this.positions = positions_mm;
    this.madeOf = this.madeWith = null;  // what the depths were computed of
    this.still = null;  // what a surface that does not move was drawn for
    Object.assign(this, {columns, rows, extent: extentOf(positions_mm)});
    this.times = Math.max(1, Math.floor((finest - 1) / (Math.max(columns, rows) - 1)));
    const spline = () => new Spline(columns, rows, this.times);
    this.base = [0, 1, 2].map((axis) => spline().update(positions_mm, 3, axis));
    this.splines = [0, 1, 2].map(spline);
    this.tints = spline();
    const {wide, high} = this.tints, geometry = new BufferGeometry(), grid = new BufferGeometry();
    for (const name of ["position", "color"]) {
      geometry.setAttribute(name, new BufferAttribute(new Float32Array(3 * wide * high), 3).setUsage(DynamicDrawUsage));
    }
    const step = Math.ceil(Math.max(wide, high) / (finest + 1));  // of more nodes than can be told apart, every second, say
    const every = step * Math.ceil((Math.ceil(Math.max(columns, rows) / mostLines) * this.times) / step);
    const faces = [], lines = [];
    for (let y = 0; y < high - 1; y += step) {
      for (let x = 0; x < wide - 1; x += step) {
        const right = Math.min(x + step, wide - 1), up = Math.min(y + step, high - 1);
        const [i, east, north, far] = [[x, y], [right, y], [x, up], [right, up]].map(([column, row]) => row * wide + column);
        faces.push(i, north, east, east, north, far);
        if (y % every === 0) lines.push(i, east);
        if (x % every === 0) lines.push(i, north);
      }
    }
    geometry.setIndex(faces);
    grid.setAttribute("position", geometry.getAttribute("position"));
    grid.setIndex(lines);
    for (const old of this.children) old.geometry.dispose();
    this.clear();
    this.mesh = new Mesh(geometry, this.material);
    this.ruled = new LineSegments(grid, this.ink);
    this.mesh.frustumCulled = this.ruled.frustumCulled = false;
    this.add(this.mesh, this.ruled);
  }

  /**
   * @param times how often the motion into the gel is drawn larger
   * @param full_mm the motion that has the full colour
   * @param ofBody of a body, whose motion is not known: how strong each node's force is, 0 ... 1
   * @param eye direction to the camera
   */
  update(model, times, full_mm, eye, ofBody = null) {
    this.#prepare(model);
    const isMoved = model.displacement_mm.length === model.positions_mm.length;
    const still = isMoved || ofBody ? null : [theme.isLight, ...eye.toArray().map((one) => one.toFixed(2))].join(" ");
    if (still !== null && still === this.still) return;
    this.still = still;
    const {rest, deep, raised} = this, sun = sunlight, {wide, high} = this.tints, [bx, by, bz] = this.base;
    const [u, v] = this.splines.map((spline, axis) => (isMoved && axis < 2 ? spline.update(model.displacement_mm, 3, axis) : spline.values));
    const w = this.inwards(model);
    const tint = ofBody ? this.tints.update(ofBody) : null;
    const sideways = Math.min(times, mostSideways);
    const position = this.mesh.geometry.getAttribute("position").array, colour = this.mesh.geometry.getAttribute("color").array;
    for (let i = 0; i < w.length; ++i) {
      position[3 * i] = bx[i] + sideways * u[i];
      position[3 * i + 1] = by[i] + sideways * v[i];
      position[3 * i + 2] = bz[i] + times * w[i];
    }
    const halfway = this.halfway.copy(eye).add(this.sun).normalize();  // Blinn, 1977
    for (let y = 0, i = 0; y < high; ++y) {
      for (let x = 0; x < wide; ++x, ++i) {
        const east = 3 * (x + 1 < wide ? i + 1 : i), west = 3 * (x > 0 ? i - 1 : i);
        const north = 3 * (y + 1 < high ? i + wide : i), south = 3 * (y > 0 ? i - wide : i);
        const ax = position[east] - position[west], ay = position[east + 1] - position[west + 1], az = position[west + 2] - position[east + 2];
        const cx = position[north] - position[south], cy = position[north + 1] - position[south + 1], cz = position[south + 2] - position[north + 2];
        const nx = ay * cz - az * cy, ny = az * cx - ax * cz, nz = ax * cy - ay * cx;  // in the scene, whose z points to the eye
        const size = 1 / Math.sqrt(nx * nx + ny * ny + nz * nz);
        const light = ambient + diffuse * Math.max(0, (nx * sun[0] + ny * sun[1] + nz * sun[2]) * size);
        const shine = gloss * Math.max(0, (nx * halfway.x + ny * halfway.y + nz * halfway.z) * size) ** shininess;
        const t = tint ? Math.min(Math.max(tint[i], 0), 1) : Math.min(1, Math.abs(w[i]) / full_mm), to = w[i] >= 0 ? deep : raised;
        for (let c = 0; c < 3; ++c) colour[3 * i + c] = light * (rest[c] + (to[c] - rest[c]) * t) + shine;
      }
    }
    for (const name of ["position", "color"]) this.mesh.geometry.getAttribute(name).needsUpdate = true;
  }

  /** How deep each point is [mm]: beneath a round contact as a ball's pressure has it, not as squares around the nodes have. */
  inwards(model) {
    this.#prepare(model);
    const spline = this.splines[2], {displacement_mm} = model, rounds = model.roundsMoved;
    if (displacement_mm.length !== model.positions_mm.length || (this.madeOf === displacement_mm && this.madeWith === rounds)) return spline.values;
    [this.madeOf, this.madeWith] = [displacement_mm, rounds];
    if (rounds.length === 0) return spline.update(model.displacement_mm, 3, 2);
    const values = spline.update(this.pressed.beside(rounds, model)), [x, y] = this.base;
    for (const contact of rounds) for (let i = 0; i < values.length; ++i) values[i] += this.pressed.under(contact, x[i], y[i]);
    return values;
  }

  /** Where a node of the model is drawn. */
  placeOf(node, out) {
    const {columns, times} = this, {wide} = this.tints;
    return out.fromArray(this.mesh.geometry.getAttribute("position").array, 3 * times * (Math.floor(node / columns) * wide + (node % columns)));
  }
}
