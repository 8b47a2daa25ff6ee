// View d: the force vectors in three dimensions, and lines that follow the forces along the surface: where they curl,
// something twists.
import {BufferAttribute, BufferGeometry, Color, ConeGeometry, CylinderGeometry, DynamicDrawUsage, InstancedMesh, LineBasicMaterial,
  LineLoop, LineSegments, Matrix4, MeshLambertMaterial, Quaternion, Vector3} from "three";

import {isSlow, say} from "./canvas.js";
import {Scale, newtons} from "./scale.js";
import {Stage} from "./scene.js";
import {onTheme, rampAt, theme} from "./theme.js";

const fullArrow = 5;  // node distances
const seeds = isSlow ? 11 : 15;  // along the longer side
const steps = 26, stride = 0.5;  // of a line, in node distances
const together = isSlow ? 2 : 1;  // steps that are drawn as one
const least = 0.03;  // of the full scale: lines end there, arrows begin
const blur = 1.3;  // nodes

export class Flow {
  constructor(canvas, label, redraw) {
    this.stage = new Stage(canvas, label, redraw);
    this.label = label;
    this.scale = new Scale(0.01);
    this.frame = new LineLoop(new BufferGeometry(), new LineBasicMaterial());
    this.stage.gel.add(this.frame);
    this.lines = new LineSegments(new BufferGeometry(), new LineBasicMaterial({vertexColors: true, transparent: true}));
    this.lines.frustumCulled = false;
    this.stage.gel.add(this.lines);
    onTheme(() => this.#colour());
    this.#colour();
  }

  #colour() {
    this.frame.material.color.set(theme.quiet);
  }

  #prepare({columns, rows, positions_mm: positions}) {
    const nodes = columns * rows;
    if (this.nodes === nodes) return;
    this.nodes = nodes;
    const gel = this.stage.gel;
    if (this.shafts) gel.remove(this.shafts, this.heads);
    const material = new MeshLambertMaterial();
    const shaft = new CylinderGeometry(1, 1, 1, isSlow ? 3 : 6, 1, true).translate(0, 0.5, 0);
    const head = new ConeGeometry(1, 1, isSlow ? 4 : 8, 1, isSlow).translate(0, -0.5, 0);
    this.shafts = new InstancedMesh(shaft, material, nodes);
    this.heads = new InstancedMesh(head, material, nodes);
    for (const mesh of [this.shafts, this.heads]) {
      mesh.frustumCulled = false;
      mesh.instanceMatrix.setUsage(DynamicDrawUsage);
      gel.add(mesh);
    }
    const most = 2 * seeds * seeds * 2 * steps;
    for (const name of ["position", "color"]) {
      const attribute = new BufferAttribute(new Float32Array(most * (name === "color" ? 4 : 3)), name === "color" ? 4 : 3);
      attribute.setUsage(DynamicDrawUsage);
      this.lines.geometry.setAttribute(name, attribute);
    }
    const corner = (column, row) => new Vector3().fromArray(positions, 3 * (row * columns + column));
    const corners = [corner(0, 0), corner(columns - 1, 0), corner(columns - 1, rows - 1), corner(0, rows - 1)];
    this.frame.geometry.setFromPoints(corners);
    this.stage.frame(corners[0].distanceTo(corners[1]), corners[0].distanceTo(corners[3]));
  }

  draw(model) {
    if (!this.stage.renderer || !model.isComplete || model.columns < 2 || model.rows < 2) return this.stage.render();
    const grid = model.arrowGrid;
    this.#prepare(grid);
    const full = this.scale.update(grid.largest_N);
    model.vectors = {sequence: model.field.header.sequence, ...this.#arrows(grid, full)};
    model.flow = this.#flow(grid, full);
    say(this.label, `full arrow ${newtons(full)}`);
    this.stage.render();
  }

  #arrows({positions_mm: at, magnitude_N: size, force_N: force, pitch_mm: pitch}, full) {
    const mm_per_N = (fullArrow * pitch) / full;
    const up = new Vector3(0, 1, 0), direction = new Vector3(), scale = new Vector3(), place = new Vector3(), tip = new Vector3();
    const turn = new Quaternion(), matrix = new Matrix4(), colour = new Color(), rgb = [0, 0, 0];
    const from = [], to = [], node = [];
    let count = 0;
    for (let i = 0; i < size.length; ++i) {
      if (size[i] < least * full) continue;
      direction.set(force[3 * i], force[3 * i + 1], force[3 * i + 2]).divideScalar(size[i]);
      const length = size[i] * mm_per_N;
      // The object pushes: the arrow ends at the node where it presses, and begins there where it pulls.
      place.fromArray(at, 3 * i);
      tip.copy(place);
      if (direction.z > 0) place.addScaledVector(direction, -length);
      else tip.addScaledVector(direction, length);
      node.push(i);
      from.push(place.x, place.y, place.z);
      to.push(tip.x, tip.y, tip.z);
      turn.setFromUnitVectors(up, direction);
      const thick = 0.085 * pitch, head = Math.min(0.4 * length, 0.8 * pitch);
      matrix.compose(place, turn, scale.set(thick, length - 0.8 * head, thick));
      this.shafts.setMatrixAt(count, matrix);
      matrix.compose(tip, turn, scale.set(0.42 * head, head, 0.42 * head));
      this.heads.setMatrixAt(count, matrix);
      rampAt((theme.isLight ? 0.05 : 0.3) + 0.65 * (size[i] / full), rgb);
      colour.setRGB(...rgb, "srgb");
      this.shafts.setColorAt(count, colour);
      this.heads.setColorAt(count, colour);
      ++count;
    }
    for (const mesh of [this.shafts, this.heads]) {
      mesh.count = count;
      mesh.instanceMatrix.needsUpdate = true;
      if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
    }
    return {node, from_mm: from, to_mm: to, mm_per_N};
  }

  /** Of the forces' part in the surface, as a hand would feel it: over a node and its neighbours (a Gaussian). */
  #smooth({columns, rows, force_N: force}) {
    const reach = Math.ceil(2.5 * blur);
    const weight = Array.from({length: 2 * reach + 1}, (_, k) => Math.exp((-0.5 * (k - reach) ** 2) / blur ** 2));
    const sum = weight.reduce((a, b) => a + b);
    if (this.half?.length !== 2 * columns * rows) {
      this.half = new Float32Array(2 * columns * rows);
      this.smooth = new Float32Array(2 * columns * rows);
    }
    this.half.fill(0);
    this.smooth.fill(0);
    // What is zero, most of it, spreads nothing.
    for (let i = 0; i < columns * rows; ++i) {
      const fx = force[3 * i] / sum, fy = force[3 * i + 1] / sum;
      if (fx === 0 && fy === 0) continue;
      const column = i % columns;
      for (let k = Math.max(-reach, -column); k <= Math.min(reach, columns - 1 - column); ++k) {
        this.half[2 * (i + k)] += weight[k + reach] * fx;
        this.half[2 * (i + k) + 1] += weight[k + reach] * fy;
      }
    }
    let largest = 0;
    for (let i = 0; i < columns * rows; ++i) {
      const fx = this.half[2 * i] / sum, fy = this.half[2 * i + 1] / sum;
      if (fx === 0 && fy === 0) continue;
      const row = Math.floor(i / columns);
      for (let k = Math.max(-reach, -row); k <= Math.min(reach, rows - 1 - row); ++k) {
        this.smooth[2 * (i + k * columns)] += weight[k + reach] * fx;
        this.smooth[2 * (i + k * columns) + 1] += weight[k + reach] * fy;
      }
    }
    for (let i = 0; i < this.smooth.length; i += 2) largest = Math.max(largest, this.smooth[i] ** 2 + this.smooth[i + 1] ** 2);
    return Math.sqrt(largest);
  }

  /** Lines along the forces' part in the surface, from seeds between the nodes, both ways (Runge and Kutta's midpoint). */
  #flow(grid, full) {
    const {columns, rows, positions_mm: at} = grid;
    const strongest = this.#smooth(grid), force = this.smooth;
    const position = this.lines.geometry.getAttribute("position"), colour = this.lines.geometry.getAttribute("color");
    let count = 0, lines = 0, turns = 0, curl = 0;
    const sample = (c, r, out) => {
      const c0 = Math.min(c | 0, columns - 2), r0 = Math.min(r | 0, rows - 2), f = c - c0, g = r - r0;
      const i = 2 * (r0 * columns + c0), j = i + 2 * columns;
      const p = (1 - f) * (1 - g), q = f * (1 - g), s = (1 - f) * g, t = f * g;
      out[0] = p * force[i] + q * force[i + 2] + s * force[j] + t * force[j + 2];
      out[1] = p * force[i + 1] + q * force[i + 3] + s * force[j + 1] + t * force[j + 3];
      return Math.sqrt(out[0] * out[0] + out[1] * out[1]);
    };
    const locate = (c, r, out) => {
      const c0 = Math.min(c | 0, columns - 2), r0 = Math.min(r | 0, rows - 2), f = c - c0, g = r - r0;
      const i = 3 * (r0 * columns + c0), j = i + 3 * columns;
      for (let k = 0; k < 3; ++k) {
        out[2 + k] = (1 - g) * ((1 - f) * at[i + k] + f * at[i + 3 + k]) + g * ((1 - f) * at[j + k] + f * at[j + 3 + k]);
      }
    };
    const inside = (c, r) => c >= 0 && r >= 0 && c <= columns - 1 && r <= rows - 1;
    const strong = Math.max(strongest * least, 1e-4 * full);
    const shade = theme.isLight ? [0.64, 0.23, 0.07] : [1, 0.78, 0.45];
    const here = [0, 0, 0, 0, 0], there = [0, 0, 0, 0, 0];
    const most = position.count - 2, places = position.array, shades = colour.array;
    const put = (i, from, alpha) => {
      places[3 * i] = from[2];
      places[3 * i + 1] = from[3];
      places[3 * i + 2] = from[4] - 0.25;
      shades[4 * i] = shade[0];
      shades[4 * i + 1] = shade[1];
      shades[4 * i + 2] = shade[2];
      shades[4 * i + 3] = Math.max(0, alpha);
    };
    const across = columns >= rows ? seeds : Math.max(2, Math.round((seeds * columns) / rows));
    const upwards = rows >= columns ? seeds : Math.max(2, Math.round((seeds * rows) / columns));
    for (let sx = 0; sx < across; ++sx) {
      for (let sy = 0; sy < upwards; ++sy) {
        for (const way of [1, -1]) {
          let c = ((sx + 0.5) * (columns - 1)) / across, r = ((sy + 0.5) * (rows - 1)) / upwards;
          let size = sample(c, r, here);
          if (size < strong) break;
          locate(c, r, here);
          put(count, here, Math.min(1, 0.2 + (1.4 * size) / strongest));
          ++lines;
          for (let step = 0; step < steps && count < most; ++step) {
            const hc = c + (0.5 * stride * way * here[0]) / size, hr = r + (0.5 * stride * way * here[1]) / size;
            if (!inside(hc, hr)) break;
            const middle = sample(hc, hr, there);
            if (middle < strong) break;
            const nc = c + (stride * way * there[0]) / middle, nr = r + (stride * way * there[1]) / middle;
            if (!inside(nc, nr)) break;
            const next = sample(nc, nr, there);
            if (next < strong) break;
            locate(nc, nr, there);
            curl += Math.abs(here[0] * there[1] - here[1] * there[0]) / (size * next);
            ++turns;
            if (step % together === together - 1) {  // from where the line was put last
              const alpha = Math.min(1, 0.2 + (1.4 * next) / strongest) * (1 - (step + 1) / steps);
              put(count + 1, there, alpha);
              put(count + 2, there, alpha);
              count += 2;
            }
            c = nc, r = nr, size = next;
            for (let k = 0; k < 5; ++k) here[k] = there[k];
          }
        }
      }
    }
    for (const attribute of [position, colour]) {
      attribute.clearUpdateRanges();
      attribute.addUpdateRange(0, count * attribute.itemSize);
      attribute.needsUpdate = true;
    }
    this.lines.geometry.setDrawRange(0, count);
    return {lines, segments: count / 2, bend_rad: turns ? curl / turns : 0};
  }
}
