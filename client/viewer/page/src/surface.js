// View a: the touched surface itself as the forces deform it, a lit spline through the nodes. How deep it is pressed is
// drawn larger than it is; the scale says how much.
import {BufferAttribute, BufferGeometry, Color, DoubleSide, DynamicDrawUsage, LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial, Vector3} from "three";

import {isSlow, say} from "./canvas.js";
import {Spline} from "./contours.js";
import {Scale} from "./scale.js";
import {Stage, sunlight} from "./scene.js";
import {onTheme, theme} from "./theme.js";

const finest = isSlow ? 47 : 93;  // points along a side, at most
const height = 0.16;  // of the longer side: the full depth
const mostNodes = 2000;  // as in client/viewer/surface.cpp
const ambient = 0.54, diffuse = 0.54, gloss = 0.16, shininess = 48;
const meshEvery = 2;  // nodes between lines of the grid

export class Surface {
  constructor(canvas, label, redraw) {
    this.stage = new Stage(canvas, label, redraw);
    this.label = label;
    this.scale = new Scale(0.02);  // [mm]
    this.material = new MeshBasicMaterial({vertexColors: true, side: DoubleSide});  // lit point by point in draw(), not pixel by pixel
    this.sun = new Vector3(...sunlight);
    this.halfway = new Vector3();
    this.grid = new LineBasicMaterial({transparent: true, opacity: 0.28});
    onTheme(() => this.#colour());
    this.#colour();
  }

  #colour() {
    this.rest = new Color(theme.isLight ? "#b9cfcb" : "#4b6d75").toArray();
    this.deep = new Color(theme.isLight ? "#c96a2b" : "#ffb25c").toArray();
    this.raised = new Color(theme.isLight ? "#2f78b7" : "#7cc4ff").toArray();
    this.grid.color.set(theme.isLight ? "#17343a" : "#0b1417");
  }

  #prepare(model) {
    const {columns, rows} = model;
    if (this.columns === columns && this.rows === rows) return;
    Object.assign(this, {columns, rows});
    const times = Math.max(1, Math.floor((finest - 1) / (Math.max(columns, rows) - 1)));
    this.times = times;
    this.splines = [0, 1, 2].map(() => new Spline(columns, rows, times));
    const {wide, high} = this.splines[0];
    Object.assign(this, {wide, high});
    const geometry = new BufferGeometry();
    for (const name of ["position", "color"]) {
      geometry.setAttribute(name, new BufferAttribute(new Float32Array(3 * wide * high), 3).setUsage(DynamicDrawUsage));
    }
    const faces = [], lines = [];
    for (let y = 0; y + 1 < high; ++y) {
      for (let x = 0; x + 1 < wide; ++x) {
        const i = y * wide + x;
        faces.push(i, i + wide, i + 1, i + 1, i + wide, i + wide + 1);  // seen from where it is touched
      }
    }
    const every = meshEvery * times;
    for (let y = 0; y < high; ++y) {
      for (let x = 0; x < wide; ++x) {
        const i = y * wide + x;
        if (y % every === 0 && x + 1 < wide) lines.push(i, i + 1);
        if (x % every === 0 && y + 1 < high) lines.push(i, i + wide);
      }
    }
    geometry.setIndex(faces);
    const grid = new BufferGeometry();
    grid.setAttribute("position", geometry.getAttribute("position"));
    grid.setIndex(lines);
    if (this.mesh) this.stage.gel.remove(this.mesh, this.lines);
    this.mesh = new Mesh(geometry, this.material);
    this.lines = new LineSegments(grid, this.grid);
    this.lines.position.z = -0.05;
    this.mesh.frustumCulled = this.lines.frustumCulled = false;
    this.stage.gel.add(this.mesh, this.lines);
    const pitch = 1e3 * model.description.nodes.pitch_m;
    this.stage.frame(pitch * (columns - 1), pitch * (rows - 1));
  }

  draw(model) {
    if (!this.stage.renderer) return this.stage.render();
    const moved = model.displacement_mm;
    if (!model.isComplete || model.columns < 2 || model.rows < 2 || moved.length !== model.positions_mm.length) {
      say(this.label, model.description?.body ? "not known of this body" : model.columns * model.rows > mostNodes ?
        `not known of more than ${mostNodes} nodes` : model.description && model.hasGel ? "being computed" : "");
      return this.stage.render();
    }
    this.#prepare(model);
    const {wide, high, times, columns} = this;
    const [u, v, w] = this.splines.map((spline, axis) => spline.update(moved, 3, axis));
    let deepest = 0, largest = 0;
    for (let i = 0; i < w.length; ++i) {
      if (Math.abs(w[i]) > largest) largest = Math.abs(w[i]);
      if (w[i] > deepest) deepest = w[i];
    }
    const full = this.scale.update(largest);
    const pitch = 1e3 * model.description.nodes.pitch_m;
    const exaggeration = Math.max(1, (height * pitch * Math.max(columns - 1, this.rows - 1)) / full);
    const sideways = Math.min(exaggeration, 3);
    const geometry = this.mesh.geometry;
    const position = geometry.getAttribute("position").array;
    const colour = geometry.getAttribute("color").array;
    const step = pitch / times;
    const left = model.positions_mm[0], low = model.positions_mm[1];
    const {rest, deep, raised} = this, sun = sunlight;
    const halfway = this.halfway.copy(this.stage.camera.position).normalize().add(this.sun).normalize();  // Blinn, 1977
    for (let y = 0, i = 0; y < high; ++y) {
      for (let x = 0; x < wide; ++x, ++i) {
        position[3 * i] = left + step * x + sideways * u[i];
        position[3 * i + 1] = low + step * y + sideways * v[i];
        position[3 * i + 2] = exaggeration * w[i];
        const east = x + 1 < wide ? i + 1 : i, west = x > 0 ? i - 1 : i;
        const north = y + 1 < high ? i + wide : i, south = y > 0 ? i - wide : i;
        const dx = (exaggeration * (w[east] - w[west])) / (step * (east - west));
        const dy = (exaggeration * (w[north] - w[south])) / ((step * (north - south)) / wide);
        // The normal is (dx, dy, 1) in the scene, whose z points to the eye.
        const size = 1 / Math.sqrt(dx * dx + dy * dy + 1);
        const light = ambient + diffuse * Math.max(0, (dx * sun[0] + dy * sun[1] + sun[2]) * size);
        const shine = gloss * Math.max(0, (dx * halfway.x + dy * halfway.y + halfway.z) * size) ** shininess;
        const t = Math.min(1, Math.abs(w[i]) / full), to = w[i] > 0 ? deep : raised;
        for (let c = 0; c < 3; ++c) colour[3 * i + c] = light * (rest[c] + (to[c] - rest[c]) * t) + shine;
      }
    }
    for (const name of ["position", "color"]) geometry.getAttribute(name).needsUpdate = true;
    model.surface = {deepest_mm: deepest, exaggeration, columns: wide, rows: high};
    say(this.label, `deepest ${deepest.toFixed(2)} mm, drawn × ${exaggeration < 10 ? exaggeration.toFixed(1) : Math.round(exaggeration)}`);
    this.stage.render();
  }
}
