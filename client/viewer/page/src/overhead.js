// View b: what the camera sees, brighter than it is, and over it how the markers have moved, the forces along the surface as
// arrows, and the pressure as discs.
import {Scale, between, newtons} from "./scale.js";
import {Ground, blank, fit, isSlow, say} from "./canvas.js";
import {theme} from "./theme.js";
import {drawTouching} from "./touching.js";

const fullArrow = 2.2;  // node distances that the longest arrow takes
const fullMotion = 1.6;  // marker distances that the longest motion takes
const leastMotion_px = 0.25;  // of a marker that has moved
const shortest_px = isSlow ? 4 : 2.5;  // on the screen
const dark = 0.02, bright = 0.998;  // shares of the picture's pixels that are darker than black and than white
const sampled = 7;  // of so many of the picture's pixels one tells how bright it is
const fullDisc = 0.46;  // of a node distance: the radius where one node takes the full pressure

export class Overhead {
  #asked = 0;  // pictures that the browser was given to decode

  /** redraw(): called when there is a new picture. */
  constructor(canvas, label, redraw) {
    this.canvas = canvas;
    this.label = label;
    this.redraw = redraw;
    this.scale = new Scale(0.01);
    this.motion = new Scale(leastMotion_px);
    this.ground = new Ground();
  }

  /** Shows the camera's picture behind the arrows, once the browser has decoded it. Drops one that comes later than a newer. */
  async show({jpeg, width, height, scale, origin_px: [u, v]}, model) {
    const number = ++this.#asked;
    const decoded = await createImageBitmap(new Blob([jpeg], {type: "image/jpeg"})).catch(() => null);
    if (!decoded || number < (model.preview?.number ?? 0)) return;
    const canvas = Object.assign(document.createElement("canvas"), {width, height});
    const context = canvas.getContext("2d", {willReadFrequently: true});
    context.drawImage(decoded, 0, 0);
    decoded.close();
    const brighter = this.#stretch(context, width, height);
    model.preview = {number, canvas, width, height, scale, origin_px: [u, v], brighter};
    this.redraw();
  }

  /** Spreads the picture's light over all that a screen can show. @returns how much brighter it is */
  #stretch(context, width, height) {
    const image = context.getImageData(0, 0, width, height), {data} = image, counts = new Uint32Array(256);
    for (let i = 0; i < data.length; i += 4 * sampled) ++counts[Math.max(data[i], data[i + 1], data[i + 2])];
    const levelOf = (share) => {
      let level = 0;
      for (let left = (share * data.length) / (4 * sampled); level < 255 && (left -= counts[level]) > 0;) ++level;
      return level;
    };
    const black = 0.8 * levelOf(dark), white = Math.max(levelOf(bright), black + 24);
    this.levels ??= {black, white};
    for (const [name, level] of [["black", black], ["white", white]]) this.levels[name] += 0.1 * (level - this.levels[name]);  // no flicker
    const gain = Math.max(1, 255 / (this.levels.white - this.levels.black));
    const table = Uint8ClampedArray.from({length: 256}, (_, level) => gain * (level - this.levels.black));
    for (let i = 0; i < data.length; i += 4) {
      data[i] = table[data[i]];
      data[i + 1] = table[data[i + 1]];
      data[i + 2] = table[data[i + 2]];
    }
    context.putImageData(image, 0, 0);
    return gain;
  }

  draw(model) {
    const fitted = fit(this.canvas);
    const camera = model.description?.camera;
    if (!fitted) return;
    if (!camera?.width_px) return blank(fitted), say(this.label, "");
    const {context, width, height} = fitted;
    const zoom = Math.min(width / camera.width_px, height / camera.height_px);
    const left = Math.round((width - zoom * camera.width_px) / 2), top = Math.round((height - zoom * camera.height_px) / 2);
    const toPicture = (canvas) => {
      canvas.translate(left, top);
      canvas.scale(zoom, zoom);
      canvas.translate(0.5, 0.5);  // (0, 0) is the centre of the first pixel
    };
    this.ground.put(fitted, [zoom, left, top, model.name, model.preview?.number], (below) => {
      below.beginPath();
      below.roundRect(left, top, zoom * camera.width_px, zoom * camera.height_px, 6);
      below.clip();
      below.fillStyle = theme.isLight ? "#eceeeb" : "#0b1013";
      below.fillRect(left, top, zoom * camera.width_px, zoom * camera.height_px);
      if (!model.preview) return;
      // Its pixels lie in the camera's: the first one's centre at the origin.
      const {canvas, width: wide, height: high, scale, origin_px: [u, v]} = model.preview;
      toPicture(below);
      below.drawImage(canvas, u - scale / 2, v - scale / 2, scale * wide, scale * high);
    });
    context.save();
    context.beginPath();
    context.rect(left, top, Math.floor(zoom * camera.width_px), Math.floor(zoom * camera.height_px));  // of whole pixels, which costs nothing
    context.clip();
    toPicture(context);
    if (!model.preview) this.#markers(context, model, zoom);
    const motion = this.#motion(context, model, zoom);
    let words = "";
    if (model.isComplete && model.places_px.length === 2 * model.columns * model.rows) {
      context.globalAlpha = model.isGhost ? 0.35 : 1;
      model.arrows = this.#forces(context, model.arrowGrid, zoom, theme.isLight && !model.preview);
      context.globalAlpha = 1;
      const {brighter} = model.preview ?? {};
      words = model.ghostWords + [`full arrow ${newtons(model.arrows.full_N)}`, motion && `motion × ${motion}`,
        brighter > 1.05 && `light × ${brighter.toFixed(1)}`].filter(Boolean).join(", ");
    }
    say(this.label, words);
    if (model.places_px.length === 2 * model.columns * model.rows && model.columns > 1 && model.rows > 1) {
      drawTouching(context, model, (point) => {
        const at = model.gridPlace(point);
        return [0, 1].map((axis) => between(model.places_px, model.columns, model.rows, ...at, 2, axis));
      }, model.preview ? "#e3eaec" : theme.text);
    }
    context.restore();
  }

  #markers(context, model, zoom) {
    const {camera, layers, zero} = model.description;
    const places = model.markers_px.length ? model.markers_px : zero?.rest_position_px ?? [];
    const focal_px = camera.focal_px * Math.sqrt(camera.aspect);
    context.globalAlpha = 0.6;
    let i = 0;
    for (const layer of layers) {
      const end = Math.min(i + 2 * layer.columns * layer.rows, places.length);
      const radius = Math.max(1 / zoom, (0.5 * layer.diameter_m * focal_px) / Math.max(1e-3, camera.position_m[2] - layer.depth_m));
      context.fillStyle = {blue: theme.blue, red: theme.red}[layer.colour] ?? theme.quiet;
      context.beginPath();
      for (; i < end; i += 2) {
        if (Number.isNaN(places[i])) continue;  // not seen
        context.moveTo(places[i] + radius, places[i + 1]);
        context.arc(places[i], places[i + 1], radius, 0, 7);
      }
      context.fill();
    }
    context.globalAlpha = 1;
  }

  /** Arrows by which the markers have moved, in steps of 1, 2, 5 times as long. @returns that factor; 0: none has moved */
  #motion(context, model, zoom) {
    const {markers_px: now, description: {zero, layers}} = model, rest = zero?.rest_position_px;
    if (!rest || now.length !== rest.length || !model.isTouched) return 0;
    let largest = leastMotion_px;
    for (let i = 0; i < now.length; i += 2) largest = Math.max(largest, Math.hypot(now[i] - rest[i], now[i + 1] - rest[i + 1]) || 0);
    const pitch = Math.hypot(rest[2] - rest[0], rest[3] - rest[1]) || 10;
    const times = Math.max(1, Math.round((fullMotion * pitch) / this.motion.update(largest)));
    if (layers.length === 0) return 0;
    context.strokeStyle = model.preview || !theme.isLight ? "rgba(235,242,244,.85)" : theme.quiet;
    context.lineWidth = 1 / zoom;
    context.beginPath();
    for (let i = 0; i < now.length; i += 2) {
      const dx = times * (now[i] - rest[i]), dy = times * (now[i + 1] - rest[i + 1]);
      if (Math.hypot(dx, dy) * zoom > shortest_px) arrow(context, rest[i], rest[i + 1], dx, dy, 0.3 * pitch, 5 / zoom);  // not NaN, of one that is not seen
    }
    context.stroke();
    return times;
  }

  #forces(context, {columns, rows, places_px: places, force_N: force, largest_N}, zoom, isOnLight) {
    const [across, up, pitch] = axes(places, columns, rows);
    const full = this.scale.update(largest_N);
    const px_per_N = (fullArrow * pitch) / full;
    const nodes = force.length / 3;
    const from = [], to = [], node = [];
    context.fillStyle = isOnLight ? theme.accent : "#58c4b8";  // the camera's picture is dark
    const alpha = context.globalAlpha;
    context.globalAlpha = alpha * (isOnLight ? 0.32 : 0.5);
    context.beginPath();
    for (let i = 0; i < nodes; ++i) {
      const radius = fullDisc * pitch * Math.sqrt(Math.min(1, Math.abs(force[3 * i + 2]) / full));
      if (radius < 0.04 * pitch) continue;
      context.moveTo(places[2 * i] + radius, places[2 * i + 1]);
      context.arc(places[2 * i], places[2 * i + 1], radius, 0, 7);
    }
    context.fill();
    context.globalAlpha = alpha;
    context.strokeStyle = context.fillStyle = isOnLight ? "#a33b12" : "#ffc36b";
    context.lineWidth = 1.6 / zoom;
    context.lineCap = "round";
    context.beginPath();
    for (let i = 0; i < nodes; ++i) {
      const fx = force[3 * i], fy = force[3 * i + 1];
      if (fx === 0 && fy === 0) continue;
      const x = places[2 * i], y = places[2 * i + 1];
      const dx = px_per_N * (fx * across[0] + fy * up[0]), dy = px_per_N * (fx * across[1] + fy * up[1]);
      node.push(i);
      from.push(x, y);
      to.push(x + dx, y + dy);
      if (Math.hypot(dx, dy) * zoom > 1.5) arrow(context, x, y, dx, dy, 0.45 * pitch);
    }
    context.stroke();
    return {node, from_px: from, to_px: to, px_per_N, full_N: full};
  }
}

/** Adds an arrow to the context's path. @param most length of its head @param least length of an arrow that has one */
function arrow(context, x, y, dx, dy, most, least = 0) {
  const length = Math.hypot(dx, dy), head = Math.min(0.35 * length, most) / length;
  context.moveTo(x, y);
  context.lineTo(x + dx, y + dy);
  if (length < least) return;
  for (const side of [0.5, -0.5]) {
    context.moveTo(x + dx, y + dy);
    context.lineTo(x + dx - head * (dx - side * dy), y + dy - head * (dy + side * dx));
  }
}

/** Unit vectors of the gel's x and y in the picture, of a mean node distance [px]. */
function axes(places, columns, rows) {
  const step = (a, b) => [places[2 * b] - places[2 * a], places[2 * b + 1] - places[2 * a + 1]];
  const last = columns * rows - 1;
  const across = columns > 1 ? step(0, columns - 1) : [1, 0];
  const up = rows > 1 ? step(0, last - columns + 1) : [0, -1];
  const unit = ([x, y]) => { const size = Math.hypot(x, y) || 1; return [x / size, y / size]; };
  const pitch = Math.hypot(...across) / Math.max(1, columns - 1);
  return [unit(across), unit(up), pitch || 10];
}
