// Step 7: what was measured and how well, on one page, to be printed or saved.
import {digits, figureTable, make, noteList, when} from "./parts.js";

const style = `body{font:15px/1.5 system-ui,sans-serif;max-width:46rem;margin:2rem auto;padding:0 1rem;color:#1b2428;font-variant-numeric:tabular-nums}
h1{font-size:1.5rem;font-weight:600}h2{font-size:1.05rem;border-bottom:1px solid #ccc;margin:1.6rem 0 .5rem;break-after:avoid}table{border-collapse:collapse}
th{text-align:left;font-weight:500;padding:.1rem 1.2rem .1rem 0;color:#5a6a70}td{text-align:right;padding:.1rem .8rem .1rem 0}img{max-width:100%}
.quiet{color:#5a6a70}ul{padding-left:1.2rem}pre{font-size:.72rem;white-space:pre-wrap;overflow-wrap:anywhere}section{break-inside:avoid}@page{margin:18mm}`;

const section = (title, date, ...content) => make("section", {}, make("h2", {}, title), ...content, date && make("p", {class: "quiet"}, `measured ${when(date)}`));

function weightTable(weights, stiffness) {
  // Each reading was taken with the modulus before; with the new one it is that many times larger.
  const moduli = stiffness ? stiffness.figures : {}, found = moduli.youngs_modulus_pa?.value;
  const now = ({gf, figures}) => {
    const own = Object.entries(moduli).find(([name]) => name.startsWith(`youngs_modulus_by_${Number(gf.toPrecision(4))}_`));
    return own ? (figures.weight_gf.value * found) / own[1].value : NaN;
  };
  return make("table", {class: "figures"}, make("thead", {}, make("tr", {}, ["true", "read before", "read with the new modulus", "off by"].map((word) => make("th", {scope: "col"}, word)))),
    make("tbody", {}, weights.read.map((one) => make("tr", {}, make("th", {scope: "row"}, `${digits(one.gf)} gf`), make("td", {}, `${one.figures.reading_gf.value.toFixed(1)} gf`),
      make("td", {}, `${now(one).toFixed(1)} gf`), make("td", {}, `${(100 * (now(one) / one.gf - 1)).toFixed(2)} %`)))));
}

/** The report as an element. @param steps what was kept of each step @param gelFile its text, or empty */
export function reportOf(steps, description, gelFile) {
  const {camera, lens, gel, pose, zero, geometry, noise, weights, stiffness, creep, recovery, finish} = steps, form = gel?.form;
  const hash = /hash = "([0-9a-f]+)"/.exec(gelFile)?.[1];
  return make("article", {class: "report"},
    make("h1", {}, `Gel ${finish?.path?.match(/([^/]+)-\d{8}T\d{6}Z(-\d+)?\.toml$/)?.[1] ?? ""} of ${description?.header.sensor ?? "this sensor"}`),
    make("p", {class: "quiet"}, `${when(new Date().toISOString())}. Deviations are standard deviations.`),
    camera && section("Camera", camera.date, make("p", {}, `${[camera.vendor, camera.model, camera.serial].filter(Boolean).join(" ")}, ${camera.width_px} × ${camera.height_px} px, ${camera.pixel_format}`),
      make("p", {}, camera.markers ? `Markers are ${camera.diameter_px.toFixed(1)} px wide and ${camera.pitch_px.toFixed(1)} px apart; ` : "", `${(100 * camera.clipped).toFixed(2)} % of the levels are overexposed.`)),
    lens ? section("Lens", lens.date, make("p", {}, `Of ${lens.pictures} pictures of a chessboard with squares of ${lens.square_mm.join(" × ")} mm.`), figureTable(lens.figures), noteList(lens.notes))
      : form && section("Lens", "", make("p", {}, `Not measured: ${form.lens_mm} mm and pixels of ${form.pixel_um} µm, by the data sheet.`)),
    form && section("Gel", "", make("p", {}, `${form.width_mm} × ${form.height_mm} × ${form.thickness_mm} mm; ${form.window === "none" ? "no window" : `window of ${form.window}, ${form.window_mm} mm`}; index ${form.gel_index}, Poisson's ratio ${form.poisson_ratio}.`),
      make("ul", {}, form.layers.map((layer) => make("li", {}, `${layer.columns} × ${layer.rows} ${layer.colour} markers, ${layer.contrast}, every ${layer.pitch_mm} mm, ${layer.diameter_mm} mm wide, ${layer.depth_mm} mm deep, centre ${layer.x_mm}, ${layer.y_mm} mm`)))),
    pose && section("Pose", pose.date, figureTable(pose.figures), noteList(pose.notes), pose.picture && make("img", {src: "setup/marked.png", alt: "The markers found"})),
    zero && section("Zero", zero.date, make("p", {}, `${zero.present} of ${zero.expected} markers seen; noise of a pixel ${digits(zero.noise_levels, zero.noise_levels / 20)} levels.`, zero.remark && ` ${zero.remark}`)),
    geometry && section("Pose, from the zero", geometry.date, figureTable(geometry.figures), noteList(geometry.remarks)),
    noise && section("Noise", noise.date, figureTable(noise.figures), noteList(noise.remarks)),
    weights && section("Weights", weights.date, weightTable(weights, stiffness)),
    stiffness && section("Stiffness", stiffness.date, figureTable(stiffness.figures), noteList(stiffness.remarks)),
    (recovery ?? creep) && section("Creep", (recovery ?? creep).date, figureTable((recovery ?? creep).figures), noteList((recovery ?? creep).remarks)),
    finish && section("Gel file", finish.date, make("p", {}, finish.path, hash && make("span", {}, ", hash ", make("code", {}, hash)))),
    gelFile && make("details", {}, make("summary", {}, "Its text"), make("pre", {}, gelFile)));
}

async function dataUrl(source) {
  const blob = await (await fetch(source)).blob();
  return new Promise((resolve) => {
    const reader = new FileReader();
    reader.onload = () => resolve(reader.result);
    reader.readAsDataURL(blob);
  });
}

/** One file with all that it shows. */
async function saved(article) {
  const copy = article.cloneNode(true);
  for (const image of copy.querySelectorAll("img")) image.src = await dataUrl(image.getAttribute("src"));
  for (const details of copy.querySelectorAll("details")) details.open = true;
  const title = copy.querySelector("h1").textContent;
  return `<!doctype html>\n<html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>${title.replace(/[<&]/g, "")}</title><style>${style}</style>\n${copy.outerHTML}</html>\n`;
}

export const report = {
  name: "report",
  title: "Report",
  isDone: ({steps}) => Boolean(steps.adopted),

  async show(box, setup) {
    const {steps, files} = setup.state, file = files.includes("calibrated.toml") ? "calibrated.toml" : files.includes("gel.toml") ? "gel.toml" : null;
    const text = file ? await (await fetch(`setup/${file}`)).text() : "";
    const article = reportOf(steps, setup.sensor.model.description, text);
    const save = make("button", {class: "main", onclick: async () => {
      const url = URL.createObjectURL(new Blob([await saved(article)], {type: "text/html"}));
      make("a", {href: url, download: "gel-report.html"}).click();
      setTimeout(() => URL.revokeObjectURL(url), 10_000);
    }}, "Save as HTML");
    box.append(make("p", {class: "row unprinted"}, save, make("button", {onclick: () => print()}, "Print, or save as PDF"), file && make("a", {href: `setup/${file}`, download: "gel.toml", class: "button"}, "Save the gel file")), article,
      make("p", {class: "quiet unprinted"}, `All pictures and files are in ${setup.state.folder}.`));
  },
};
