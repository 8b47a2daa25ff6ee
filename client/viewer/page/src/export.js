// What is seen as files: the views as a picture, the plot as numbers or a drawing.

/** Side by side on one canvas, as they are at this moment: what WebGL has drawn is gone after the frame. */
function compose(canvases) {
  const columns = Math.ceil(Math.sqrt(canvases.length)), sheet = document.createElement("canvas");
  const width = Math.max(...canvases.map((canvas) => canvas.width)), height = Math.max(...canvases.map((canvas) => canvas.height));
  Object.assign(sheet, {width: columns * width, height: Math.ceil(canvases.length / columns) * height});
  const context = sheet.getContext("2d");
  context.fillStyle = getComputedStyle(document.documentElement).getPropertyValue("--card");
  context.fillRect(0, 0, sheet.width, sheet.height);
  canvases.forEach((canvas, i) => context.drawImage(canvas, (i % columns) * width, Math.floor(i / columns) * height));
  return sheet;
}

function save(blob, name, ending) {
  const url = URL.createObjectURL(blob);
  const time = new Date().toISOString().slice(0, 19).replaceAll(":", "-");
  Object.assign(document.createElement("a"), {href: url, download: `${name}-${time}.${ending}`}).click();
  setTimeout(() => URL.revokeObjectURL(url), 1000);
}

export function savePicture(canvases, name) {
  compose(canvases).toBlob((blob) => save(blob, name, "png"));
}

const dense = 2;  // pixels of a drawing's unit

/** The drawing as a picture. @returns what is saved */
export async function saveDrawing(svg, name) {
  const drawn = new Image(), url = URL.createObjectURL(new Blob([svg], {type: "image/svg+xml"}));
  drawn.src = url;
  await drawn.decode();
  const canvas = Object.assign(document.createElement("canvas"), {width: dense * drawn.width, height: dense * drawn.height});
  canvas.getContext("2d").drawImage(drawn, 0, 0, canvas.width, canvas.height);
  URL.revokeObjectURL(url);
  const blob = await new Promise((done) => canvas.toBlob(done));
  save(blob, name, "png");
  return blob;
}

const types = {csv: "text/csv", svg: "image/svg+xml"};
export function saveText(text, name, ending) {
  save(new Blob([text], {type: types[ending]}), name, ending);
}
