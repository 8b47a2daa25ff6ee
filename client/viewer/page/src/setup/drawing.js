// The gel to scale, from the side and from the camera, as the form has it.
import {draw, make} from "./parts.js";

const colours = {blue: "var(--z)", red: "var(--x)", green: "var(--y)", grey: "var(--quiet)"};
const mostDots = 900;  // of a layer: beyond, an outline says as much

function dots(layer, sign, place, scale) {
  const {columns, rows, pitch_mm, diameter_mm, x_mm, y_mm, colour, contrast} = layer;
  const fill = colours[colour] ?? colours.grey, radius = Math.max(1, (scale * diameter_mm) / 2);
  const look = contrast === "darker" ? {fill, stroke: "var(--text)", "stroke-width": 0.5} : {fill};
  const made = draw("g", look);
  const many = columns * rows > mostDots ? Math.ceil(Math.sqrt((columns * rows) / mostDots)) : 1;
  for (let column = 0; column < columns; column += many) {
    for (let row = 0; row < (sign ? rows : 1); row += many) {
      const [u, v] = place(x_mm + pitch_mm * (column - (columns - 1) / 2), y_mm + pitch_mm * (row - (rows - 1) / 2), layer.depth_mm);
      made.append(draw("circle", {cx: u, cy: v, r: radius}));
    }
  }
  return made;
}

const isWhole = (form) => [form.width_mm, form.height_mm, form.thickness_mm].every((one) => one > 0) &&
  form.layers.every(({columns, rows, pitch_mm, depth_mm, diameter_mm}) => columns >= 1 && columns <= 400 && rows >= 1 && rows <= 400 && pitch_mm > 0 && depth_mm >= 0 && diameter_mm > 0);

/** @returns the two drawings; what they cannot show as long as a number is missing is left as it was */
export function drawGel(box, form) {
  if (!isWhole(form)) return;
  const span = Math.max(form.width_mm, form.height_mm), scale = 260 / span;
  const wide = scale * form.width_mm, high = scale * form.height_mm, thick = scale * form.thickness_mm;
  const pane = form.window === "none" ? 0 : scale * (form.window_mm || 0);
  const line = (attributes) => draw("line", {stroke: "var(--quiet)", ...attributes});
  const text = (x, y, words, anchor = "start") => draw("text", {x, y, "text-anchor": anchor}, words);

  const lowest = thick + Math.min(pane, 60);
  const side = draw("svg", {viewBox: `-20 -26 ${wide + 150} ${lowest + 62}`, role: "img", "aria-label": "The gel from the side: touched surface at the top, layers of markers, window, camera"},
    draw("rect", {x: 0, y: 0, width: wide, height: thick, class: "gel"}),
    pane ? draw("rect", {x: -8, y: thick, width: wide + 16, height: Math.min(pane, 60), class: "window"}) : "",
    text(wide / 2, -10, "touched surface", "middle"),
    ...form.layers.map((layer) => dots(layer, 0, (x, y, z) => [wide / 2 + scale * x, scale * z], scale)),
    ...form.layers.map((layer, i) => text(wide + 14, scale * layer.depth_mm + 4 + (i && Math.abs(scale * (layer.depth_mm - form.layers[i - 1].depth_mm)) < 13 ? 13 : 0), `${layer.depth_mm} mm ${layer.colour}`)),
    text(wide + 14, thick + 4, `${form.thickness_mm} mm`), line({x1: wide, y1: thick, x2: wide + 10, y2: thick}),
    draw("path", {d: `M${wide / 2 - 9} ${lowest + 32} l18 0 l-5 -12 l-8 0 z`, class: "eye"}), text(wide / 2 + 16, lowest + 30, `camera, ${form.distance_mm || "?"} mm from the surface`));
  const top = draw("svg", {viewBox: `-20 -22 ${wide + 150} ${high + 30}`, role: "img", "aria-label": "The gel as the camera sees it, with its markers"},
    draw("rect", {x: 0, y: 0, width: wide, height: high, class: "gel"}),
    text(wide / 2, -8, `${form.width_mm} × ${form.height_mm} mm, as the camera sees it`, "middle"),
    ...form.layers.map((layer) => dots(layer, 1, (x, y) => [wide / 2 + scale * x, high / 2 - scale * y], scale)));
  box.replaceChildren(make("div", {class: "drawings"}, side, top));
}

/** What cannot be made or seen, before it is printed. */
export function doubts(form) {
  const found = [];
  form.layers.forEach(({columns, rows, pitch_mm, diameter_mm, depth_mm, x_mm, y_mm}, i) => {
    const name = form.layers.length > 1 ? `layer ${i + 1}: ` : "";
    if (depth_mm >= form.thickness_mm) found.push(`${name}it lies below the gel`);
    if (pitch_mm < 1.75 * diameter_mm) found.push(`${name}markers are too close: the pitch is to be 1.75 diameters at least`);
    if (Math.abs(x_mm) + (pitch_mm * (columns - 1) + diameter_mm) / 2 > form.width_mm / 2 || Math.abs(y_mm) + (pitch_mm * (rows - 1) + diameter_mm) / 2 > form.height_mm / 2) found.push(`${name}markers lie beside the gel`);
    form.layers.slice(0, i).forEach((other, j) => {
      if (other.colour === form.layers[i].colour && other.contrast === form.layers[i].contrast) found.push(`layers ${j + 1} and ${i + 1} look alike: choose another colour, or the other contrast`);
      if (Math.abs(x_mm - other.x_mm) + Math.abs(y_mm - other.y_mm) < 0.25 * pitch_mm) found.push(`${name}it hides layer ${j + 1}: shift it by half a pitch`);
    });
  });
  return found;
}
