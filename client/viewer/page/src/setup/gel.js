// Step 3: the gel, as a form with a drawing of it; and the sheets to print its markers from.
import {doubts, drawGel} from "./drawing.js";
import {choiceField, make, noteList, numberField} from "./parts.js";

const paperLayer = {colour: "blue", contrast: "brighter", columns: 24, rows: 24, pitch_mm: 3, depth_mm: 6, diameter_mm: 0.6, x_mm: 0, y_mm: 0};
const shores = {"": "known modulus", 5: "Shore A 5", 10: "Shore A 10", 15: "Shore A 15", 20: "Shore A 20"};

/** Gent 1958, from the Shore A hardness [kPa]; docs/sensor.md. */
const ofShore = (hardness) => Math.round(98.1 * (56 + 7.62 * hardness) / (0.1375 * (254 - 2.54 * hardness)));

function firstForm(look) {
  const layers = look?.grey ? [{...paperLayer, colour: "grey", contrast: "darker", depth_mm: 8}]
    : [{...paperLayer}, {...paperLayer, colour: "red", depth_mm: 8, x_mm: 1.5, y_mm: 1.5}];
  return {width_mm: 100, height_mm: 100, thickness_mm: 40, youngs_modulus_kpa: 180, poisson_ratio: 0.49, gel_index: 1.41, window: "acrylic",
    window_mm: 8, distance_mm: 160, marker_depth_mm: 0, marker_place_mm: 0, lens_mm: 8, pixel_um: 5.6, width_px: look?.width_px ?? 640,
    height_px: look?.height_px ?? 480, layers};
}

export const gel = {
  name: "gel",
  title: "Gel",
  isDone: ({steps}) => Boolean(steps.gel),

  show(box, setup) {
    const {steps, stale, files} = setup.state, isLensKnown = files.includes("lens.toml");
    const form = structuredClone((steps.gel ?? stale.gel)?.form ?? firstForm(steps.camera));
    if (steps.camera) Object.assign(form, {width_px: steps.camera.width_px, height_px: steps.camera.height_px});
    const picture = make("div", {class: "drawing"}), warnings = make("div"), layers = make("div"), trouble = make("p", {class: "fault", role: "alert"}), sheets = make("p");
    const changed = () => {
      drawGel(picture, form);
      warnings.replaceChildren(...[noteList(doubts(form))].filter(Boolean));
    };
    const number = (from, label, unit, key, title) => numberField(label, unit, from[key], (value) => { from[key] = value; changed(); }, {title});
    const choice = (from, label, choices, key, title) => choiceField(label, choices, from[key], (value) => { from[key] = value; changed(); }, title);

    const layerBox = (layer, i) => make("fieldset", {}, make("legend", {}, `Layer ${i + 1}${i === 0 ? ", next to the touched surface" : ""}`),
      make("div", {class: "fields"},
        choice(layer, "Light in which they stand out", {blue: "blue", red: "red", green: "green", grey: "all (grey)"}, "colour", "yellow ink on white: blue, darker; black ink: all, darker"),
        choice(layer, "Markers are", {brighter: "brighter", darker: "darker"}, "contrast"),
        number(layer, "Columns", "", "columns"), number(layer, "Rows", "", "rows"), number(layer, "Pitch", "mm", "pitch_mm", "as printed: measure ten"),
        number(layer, "Diameter", "mm", "diameter_mm"), number(layer, "Depth below the touched surface", "mm", "depth_mm", "of the mould's stop: forces depend on it"),
        number(layer, "Centre right", "mm", "x_mm", "of the grid, against the gel's centre"), number(layer, "Centre up", "mm", "y_mm")),
      form.layers.length > 1 && make("button", {type: "button", onclick: () => { form.layers.splice(i, 1); fillLayers(); }}, "Remove this layer"));
    const fillLayers = () => {
      layers.replaceChildren(...form.layers.map(layerBox), form.layers.length < 4 && make("button", {type: "button", onclick: () => {
        const last = form.layers.at(-1);
        form.layers.push({...last, colour: last.colour === "blue" ? "red" : "blue", depth_mm: last.depth_mm + 2, x_mm: last.x_mm + last.pitch_mm / 2, y_mm: last.y_mm + last.pitch_mm / 2});
        fillLayers();
      }}, "Add a layer"));
      changed();
    };
    const save = make("button", {class: "main", onclick: async () => {
      const reply = await setup.run(save, {do: "gel", form}, trouble);
      if (!reply) return;
      setup.took("gel", {form});
      const names = await setup.run(save, {do: "sheet"}, trouble);
      if (names) setup.state.files = names, links();
    }}, "Keep this gel");
    const links = () => sheets.replaceChildren(...(setup.state.files.some((name) => name.startsWith("layer")) ? ["Sheets to print the markers from, at 100 %: ",
      ...setup.state.files.filter((name) => name.startsWith("layer")).flatMap((name) => [make("a", {href: `setup/${name}`, download: name}, name), " "])] : []));
    box.append(
      make("p", {}, "Write what a calliper, the printed sheet and the mould say. The weights will replace the modulus; it may be wrong by a factor of two."),
      make("div", {class: "pair"}, make("div", {},
        make("fieldset", {}, make("legend", {}, "Block"), make("div", {class: "fields"},
          number(form, "Width, right in the picture", "mm", "width_mm"), number(form, "Height, up in the picture", "mm", "height_mm"), number(form, "Thickness", "mm", "thickness_mm"),
          choiceField("Hardness", shores, "", (value) => {
            if (value === "") return;
            form.youngs_modulus_kpa = ofShore(Number(value));
            modulus.querySelector("input").value = form.youngs_modulus_kpa;
            changed();
          }, "of the data sheet; Young's modulus by Gent's relation"))),
        layers,
        make("fieldset", {}, make("legend", {}, "Window and camera"), make("div", {class: "fields"},
          choice(form, "Window", {none: "none", acrylic: "acrylic", glass: "glass"}, "window"), number(form, "Its thickness", "mm", "window_mm"),
          number(form, "Refractive index of the gel", "", "gel_index", "silicone 1.41"), number(form, "Lens to touched surface, about", "mm", "distance_mm", "the pose is measured next"),
          !isLensKnown && number(form, "Focal length of the lens", "mm", "lens_mm", "the lens was not measured"), !isLensKnown && number(form, "Size of the camera's pixels", "µm", "pixel_um"))),
        make("details", {}, make("summary", {}, "Made by hand"), make("div", {class: "fields"},
          number(form, "Poisson's ratio", "", "poisson_ratio"), number(form, "Markers lie off their layer's depth by", "mm", "marker_depth_mm", "standard deviation; 0.1 in layers made by hand"),
          number(form, "Markers lie off their grid by", "mm", "marker_place_mm", "standard deviation")))),
      make("div", {class: "beside"}, picture, warnings)),
      make("p", {}, save), trouble, sheets);
    const modulus = number(form, "Young's modulus", "kPa", "youngs_modulus_kpa");
    box.querySelector("fieldset .fields").append(modulus);
    fillLayers();
    links();
  },
};
