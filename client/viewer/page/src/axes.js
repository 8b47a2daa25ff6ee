// The axes of the views in three dimensions: the edge of the touched face, with numbers.
import {BufferGeometry, CanvasTexture, Float32BufferAttribute, Group, LineBasicMaterial, LineSegments, LinearFilter, Sprite,
  SpriteMaterial} from "three";

import {sizeOf} from "./canvas.js";
import {theme} from "./theme.js";

const every_mm = 10, numbers_mm = 20;  // between ticks, between numbers
const text_px = 22, tall_px = 32;  // of a number's picture
const shown_px = 18;  // how tall that is on the screen

/** A text that faces the camera, of the same size at any distance. */
function label(text) {
  const canvas = document.createElement("canvas"), context = canvas.getContext("2d");
  const font = `${text_px}px system-ui, sans-serif`;
  context.font = font;
  canvas.width = Math.ceil(context.measureText(text).width) + 8;
  canvas.height = tall_px;
  context.font = font;
  context.textBaseline = "middle";
  context.fillStyle = theme.quiet;
  context.fillText(text, 4, tall_px / 2);
  const map = new CanvasTexture(canvas);
  map.minFilter = LinearFilter;
  map.generateMipmaps = false;
  const sprite = new Sprite(new SpriteMaterial({map, sizeAttenuation: false, depthTest: false, transparent: true}));
  sprite.userData.wide = canvas.width / tall_px;
  return sprite;
}

export class Axes extends Group {
  #key = "";

  /**
   * Draws the axes of a face.
   * @param face its {min, max} in x and y [mm]
   * @param stage that they are in
   * @param depth the axis along z, of the view that has one: {value_mm, drawn_mm}
   */
  update(face, stage, depth = null) {
    this.#write(face, depth);
    const tall = (2 * shown_px * Math.tan((0.5 * stage.camera.fov * Math.PI) / 180)) / Math.max(1, sizeOf(stage.canvas).height);
    for (const child of this.children) if (child.isSprite) child.scale.set(tall * child.userData.wide, tall, 1);
  }

  #write(face, depth) {
    const edge = 0.04 * (face.max[0] - face.min[0]);
    this.extent = {min: [face.min[0] - (depth ? 2 : 0) * edge, face.min[1] - 1.8 * edge, face.min[2]],
      max: [face.max[0] + 2 * edge, face.max[1], face.max[2] + 0.5 * (depth?.drawn_mm ?? 0)]};
    const key = [...face.min, ...face.max, depth?.value_mm, theme.isLight].join(" ");
    if (this.#key === key) return;
    this.#key = key;
    for (const child of this.children) {
      child.geometry?.dispose();
      child.material.map?.dispose();
      child.material.dispose();
    }
    this.clear();
    const [left, low] = face.min, [right, high] = face.max, lines = [];
    const inner = (from, to, step) => {
      const found = [];
      for (let at = Math.ceil(from / step) * step; at <= to; at += step) found.push(at);
      return found;
    };
    for (const x of [left, right]) lines.push(x, low, 0, x, high, 0);
    for (const y of [low, high]) lines.push(left, y, 0, right, y, 0);
    for (const x of inner(left, right, every_mm)) lines.push(x, low, 0, x, low - 0.4 * edge, 0);
    for (const y of inner(low, high, every_mm)) lines.push(right, y, 0, right + 0.4 * edge, y, 0);
    const put = (text, x, y, z) => {
      const sprite = label(text);
      sprite.position.set(x, y, z);
      this.add(sprite);
    };
    const number = (value) => String(value).replace("-", "−");
    for (const x of inner(left, right, numbers_mm)) put(number(x), x, low - 1.4 * edge, 0);
    for (const y of inner(low, high, numbers_mm)) put(number(y), right + 1.4 * edge, y, 0);
    put("x mm", right - 0.5 * edge, low - 1.4 * edge, 0);
    put("y mm", right + 1.4 * edge, high - 0.5 * edge, 0);
    if (depth) {
      lines.push(left, low, 0, left, low, depth.drawn_mm, left, low, depth.drawn_mm, left - edge, low, depth.drawn_mm);
      put(`${number(depth.value_mm)} mm`, left - 2.2 * edge, low, depth.drawn_mm);
      put("z", left - edge, low, 0.4 * depth.drawn_mm);
    }
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new Float32BufferAttribute(lines, 3));
    this.add(new LineSegments(geometry, new LineBasicMaterial({color: theme.quiet})));
  }
}
