// View d: the force vectors in three dimensions, with what is not known of their tips, and lines that follow the forces along
// the surface: where they curl, something twists.
import {BufferAttribute, BufferGeometry, Color, ConeGeometry, CylinderGeometry, DynamicDrawUsage, InstancedMesh, LineBasicMaterial,
  LineSegments, Matrix4, MeshBasicMaterial, MeshPhongMaterial, Quaternion, SphereGeometry, Vector3} from "three";

import {Axes} from "./axes.js";
import {isSlow, say} from "./canvas.js";
import {Scale, between, newtons} from "./scale.js";
import {Stage, sunlight} from "./scene.js";
import {Skin} from "./skin.js";
import {sharesOf, slipColourAt} from "./stick_slip.js";
import {directionAt, theme} from "./theme.js";

const fullArrow = 2.7;  // node distances
const pit = 1.2;  // node distances that the full depth is drawn deep
const thick = 0.15, headWide = 0.34, headLong = 0.75;  // of a node distance
const seeds = isSlow ? 11 : 15;  // along the longer side of what is touched
const steps = 26, stride = 0.5;  // of a line, in node distances
const together = isSlow ? 2 : 1;  // steps that are drawn as one
const least = 0.03;  // of the full scale: lines end there, arrows begin
const framed = 0.1;  // of the full scale: what is to be in view
const leastSeen = 1.5;  // node distances that are in view
const blur = 1.3;  // nodes
const beyond = 2;  // nodes around what is touched where lines begin
const faded = 0.6;  // of the last touch

/** Colours a geometry along y by the light on it while it points down: for the processor, to which each pixel that is lit is dear. */
function shade(geometry) {
  const normals = geometry.getAttribute("normal"), [x, y, z] = sunlight, light = new Float32Array(3 * normals.count);
  for (let i = 0; i < normals.count; ++i) {
    const towards = x * normals.getX(i) - y * normals.getZ(i) - z * normals.getY(i);
    light.fill(0.82 + 0.34 * towards, 3 * i, 3 * i + 3);
  }
  geometry.setAttribute("color", new BufferAttribute(light, 3));
}

export class Flow {
  /** colour: what the arrows' colour tells, "direction" or "slip" */
  colour = "direction";

  constructor(canvas, label, redraw) {
    this.stage = new Stage(canvas, label, redraw);
    this.label = label;
    this.scale = new Scale(0.01);
    this.depth = new Scale(0.02);  // [mm]
    this.axes = new Axes();
    this.lines = new LineSegments(new BufferGeometry(), new LineBasicMaterial({vertexColors: true, transparent: true}));
    this.lines.frustumCulled = false;
    this.skin = new Skin(true);
    this.stage.gel.add(this.skin, this.axes, this.lines);
    const most = 2 * seeds * seeds * 2 * steps;
    for (const [name, size] of [["position", 3], ["color", 4]]) {
      this.lines.geometry.setAttribute(name, new BufferAttribute(new Float32Array(most * size), size).setUsage(DynamicDrawUsage));
    }
  }

  #prepare({columns, rows, positions_mm: positions}) {
    if (this.positions === positions) return;
    this.positions = positions;
    const {gel} = this.stage, nodes = columns * rows;
    if (this.shafts) gel.remove(this.shafts, this.heads, this.clouds);
    const solid = isSlow ? new MeshBasicMaterial({vertexColors: true}) : new MeshPhongMaterial({specular: 0x666666, shininess: 40});
    const pale = new MeshBasicMaterial({transparent: true, opacity: 0.28, depthWrite: false});
    const make = (geometry, material) => {
      if (isSlow) shade(geometry);
      const mesh = new InstancedMesh(geometry, material, nodes);
      mesh.frustumCulled = false;
      mesh.instanceMatrix.setUsage(DynamicDrawUsage);
      gel.add(mesh);
      return mesh;
    };
    this.shafts = make(new CylinderGeometry(1, 1, 1, isSlow ? 7 : 14).translate(0, 0.5, 0), solid);
    this.heads = make(new ConeGeometry(1, 1, isSlow ? 8 : 20).translate(0, -0.5, 0), solid);
    this.clouds = make(new SphereGeometry(1, isSlow ? 8 : 16, isSlow ? 6 : 12), pale);
  }

  draw(model) {
    const {gel} = this.stage;
    gel.visible = model.isComplete && model.columns > 1 && model.rows > 1;
    if (!this.stage.renderer || !gel.visible) return say(this.label, ""), this.stage.render();
    const grid = model.arrowGrid;
    this.#prepare(grid);
    const full = this.scale.update(grid.largest_N), {displacement_mm: moved} = model;
    let deepest = 0;
    for (let i = 2; i < moved.length; i += 3) deepest = Math.max(deepest, Math.abs(moved[i]));
    const full_mm = this.depth.update(deepest);
    this.skin.update(model, (pit * grid.pitch_mm) / full_mm, 4 * full_mm, this.stage.toEye);
    this.axes.visible = !model.description.body;
    this.axes.update(this.skin.extent, this.stage);
    model.vectors = {sequence: model.field.header.sequence, ...this.#arrows(model, grid, full)};
    this.lines.visible = !model.isGhost && !model.description.body;  // a body's shear lies in no plane
    if (this.lines.visible) this.#flow(grid, full);
    this.stage.follow(this.box ?? this.axes.extent, leastSeen * grid.pitch_mm);
    say(this.label, model.ghostWords + (grid.largest_N > 0 ? `full arrow ${newtons(full)}` : "nothing touches"));
    this.stage.render();
  }

  #arrows(model, {positions_mm: at, magnitude_N: size, force_N: force, deviation_N: deviation, pitch_mm: pitch}, full) {
    const mm_per_N = (fullArrow * pitch) / full;
    const up = new Vector3(0, 1, 0), direction = new Vector3(), scale = new Vector3(), place = new Vector3(), tip = new Vector3();
    const turn = new Quaternion(), upright = new Quaternion(), matrix = new Matrix4(), colour = new Color(), card = new Color(theme.card);
    const from = [], to = [], node = [];
    const shares = this.colour === "slip" && !model.isGhost ? sharesOf(model) : null;
    const min = [Infinity, Infinity, Infinity], max = [-Infinity, -Infinity, -Infinity];
    const normals = model.description.body?.node_normals, inwards = new Vector3(0, 0, 1), along = new Vector3();
    const isEach = size.length === model.columns * model.rows;
    let count = 0;
    for (let i = 0; i < size.length; ++i) {
      if (size[i] < least * full) continue;
      direction.set(force[3 * i], force[3 * i + 1], force[3 * i + 2]).divideScalar(size[i]);
      const length = size[i] * mm_per_N;
      if (normals && isEach) inwards.fromArray(normals, 3 * i);
      const pressed = direction.dot(inwards);
      along.copy(direction).addScaledVector(inwards, -pressed);
      // The object pushes: the arrow ends at the node where it presses, and begins there where it pulls.
      if (isEach) this.skin.placeOf(i, place);
      else place.fromArray(at, 3 * i);
      tip.copy(place);
      if (pressed > 0) place.addScaledVector(direction, -length);
      else tip.addScaledVector(direction, length);
      node.push(i);
      from.push(place.x, place.y, place.z);
      to.push(tip.x, tip.y, tip.z);
      if (size[i] > framed * full) {
        for (let k = 0; k < 3; ++k) {
          min[k] = Math.min(min[k], place.getComponent(k), tip.getComponent(k));
          max[k] = Math.max(max[k], place.getComponent(k), tip.getComponent(k));
        }
      }
      turn.setFromUnitVectors(up, direction);
      const head = Math.min(0.5 * length, headLong * pitch), wide = Math.min(thick * pitch, 0.2 * length);
      matrix.compose(place, turn, scale.set(wide, length - 0.8 * head, wide));
      this.shafts.setMatrixAt(count, matrix);
      matrix.compose(tip, turn, scale.set((headWide / headLong) * head, head, (headWide / headLong) * head));
      this.heads.setMatrixAt(count, matrix);
      const ofTip = (k) => Math.max(1e-3 * pitch, 2 * mm_per_N * (deviation[3 * i + k] ?? 0));
      matrix.compose(pressed > 0 ? place : tip, upright, scale.set(ofTip(0), ofTip(1), ofTip(2)));
      this.clouds.setMatrixAt(count, matrix);
      colour.setRGB(...(shares ? slipColourAt(shares.get(i)) : directionAt(along.x, along.y, along.length())));
      if (model.isGhost) colour.lerp(card, faded);
      for (const mesh of [this.shafts, this.heads, this.clouds]) mesh.setColorAt(count, colour);
      ++count;
    }
    this.clouds.visible = deviation.length > 0 && !model.isGhost;
    for (const mesh of [this.shafts, this.heads, this.clouds]) {
      mesh.count = count;
      mesh.instanceMatrix.needsUpdate = true;
      if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
    }
    // What is touched is round and the arrows are longest in its middle: a box around them has empty corners.
    for (let k = 0; k < 2; ++k) [min[k], max[k]] = [min[k] + 0.14 * (max[k] - min[k]), max[k] - 0.14 * (max[k] - min[k])];
    this.box = max[0] >= min[0] && !model.isGhost ? {min, max} : null;
    return {node, from_mm: from, to_mm: to, mm_per_N, full_N: full};
  }

  /** Of the forces' part in the surface, as a hand would feel it: over a node and its neighbours (a Gaussian). */
  #smooth({columns, rows, force_N: force}) {
    const reach = Math.ceil(2.5 * blur);
    const weight = Array.from({length: 2 * reach + 1}, (_, k) => Math.exp((-0.5 * (k - reach) ** 2) / blur ** 2));
    const sum = weight.reduce((a, b) => a + b);
    const spread = (from, stride, to) => {  // along rows, then along columns; what is zero, most of it, spreads nothing
      for (let i = 0; i < columns * rows; ++i) {
        const fx = from[stride * i] / sum, fy = from[stride * i + 1] / sum;
        if (fx === 0 && fy === 0) continue;
        const [at, count, step] = stride === 3 ? [i % columns, columns, 1] : [Math.floor(i / columns), rows, columns];
        for (let k = Math.max(-reach, -at); k <= Math.min(reach, count - 1 - at); ++k) {
          to[2 * (i + k * step)] += weight[k + reach] * fx;
          to[2 * (i + k * step) + 1] += weight[k + reach] * fy;
        }
      }
      return to;
    };
    this.smooth = spread(spread(force, 3, new Float32Array(2 * columns * rows)), 2, new Float32Array(2 * columns * rows));
    let largest = 0;
    for (let i = 0; i < this.smooth.length; i += 2) largest = Math.max(largest, this.smooth[i] ** 2 + this.smooth[i + 1] ** 2);
    return Math.sqrt(largest);
  }

  /** Where lines begin: columns and rows from first to last, around what is strong. */
  #touched({columns, rows}, strong) {
    const first = [columns - 1, rows - 1], last = [0, 0];
    for (let i = 0; i < columns * rows; ++i) {
      if (Math.hypot(this.smooth[2 * i], this.smooth[2 * i + 1]) < strong) continue;
      [i % columns, Math.floor(i / columns)].forEach((at, axis) => {
        first[axis] = Math.min(first[axis], Math.max(0, at - beyond));
        last[axis] = Math.max(last[axis], Math.min([columns, rows][axis] - 1, at + beyond));
      });
    }
    return {first, wide: Math.max(0, last[0] - first[0]), high: Math.max(0, last[1] - first[1])};
  }

  /** Lines along the forces' part in the surface, from seeds between the nodes, both ways (Runge and Kutta's midpoint). */
  #flow(grid, full) {
    const {columns, rows, pitch_mm, positions_mm: at} = grid;
    const strongest = this.#smooth(grid), force = this.smooth;
    const position = this.lines.geometry.getAttribute("position"), colour = this.lines.geometry.getAttribute("color");
    let count = 0;
    const sample = (c, r, out) => {
      for (let k = 0; k < 2; ++k) out[k] = between(force, columns, rows, c, r, 2, k);
      return Math.sqrt(out[0] * out[0] + out[1] * out[1]);
    };
    const inside = (c, r) => c >= 0 && r >= 0 && c <= columns - 1 && r <= rows - 1;
    const strong = Math.max(strongest * least, 4e-3 * full), bright = Math.max(strongest, 0.05 * full);
    const shade = theme.isLight ? [0.64, 0.23, 0.07] : [1, 0.78, 0.45];
    const here = [0, 0], there = [0, 0];
    const most = position.count - 2, places = position.array, shades = colour.array;
    const put = (i, c, r, alpha) => {
      places[3 * i] = at[0] + c * pitch_mm;
      places[3 * i + 1] = at[1] + r * pitch_mm;
      places[3 * i + 2] = -0.3;
      shades[4 * i] = shade[0];
      shades[4 * i + 1] = shade[1];
      shades[4 * i + 2] = shade[2];
      shades[4 * i + 3] = Math.max(0, alpha);
    };
    const {first, wide, high} = this.#touched(grid, 3 * strong), longer = Math.max(wide, high, 1);
    const across = Math.round((seeds * wide) / longer), upwards = Math.round((seeds * high) / longer);
    for (let sx = 0; sx < across; ++sx) {
      for (let sy = 0; sy < upwards; ++sy) {
        for (const way of [1, -1]) {
          let c = first[0] + ((sx + 0.5) * wide) / across, r = first[1] + ((sy + 0.5) * high) / upwards;
          let size = sample(c, r, here);
          if (size < strong) break;
          put(count, c, r, Math.min(1, 0.2 + (1.4 * size) / bright));
          for (let step = 0; step < steps && count < most; ++step) {
            const hc = c + (0.5 * stride * way * here[0]) / size, hr = r + (0.5 * stride * way * here[1]) / size;
            if (!inside(hc, hr)) break;
            const middle = sample(hc, hr, there);
            if (middle < strong) break;
            const nc = c + (stride * way * there[0]) / middle, nr = r + (stride * way * there[1]) / middle;
            if (!inside(nc, nr)) break;
            const next = sample(nc, nr, there);
            if (next < strong) break;
            if (step % together === together - 1) {  // from where the line was put last
              const alpha = Math.min(1, 0.2 + (1.4 * next) / bright) * (1 - (step + 1) / steps);
              put(count + 1, nc, nr, alpha);
              put(count + 2, nc, nr, alpha);
              count += 2;
            }
            c = nc, r = nr, size = next;
            [here[0], here[1]] = there;
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
  }
}
