// The views as a picture and as a film.

/** Side by side on one canvas, as they are at this moment: what WebGL has drawn is gone after the frame. */
function compose(sheet, canvases) {
  const columns = Math.ceil(Math.sqrt(canvases.length));
  const width = Math.max(...canvases.map((canvas) => canvas.width)), height = Math.max(...canvases.map((canvas) => canvas.height));
  const wide = columns * width, high = Math.ceil(canvases.length / columns) * height;
  if (sheet.width !== wide || sheet.height !== high) Object.assign(sheet, {width: wide, height: high});
  const context = sheet.getContext("2d");
  context.fillStyle = getComputedStyle(document.documentElement).getPropertyValue("--card");
  context.fillRect(0, 0, wide, high);
  canvases.forEach((canvas, i) => context.drawImage(canvas, (i % columns) * width, Math.floor(i / columns) * height));
}

function save(blob, name, ending) {
  const url = URL.createObjectURL(blob);
  const time = new Date().toISOString().slice(0, 19).replaceAll(":", "-");
  Object.assign(document.createElement("a"), {href: url, download: `${name}-${time}.${ending}`}).click();
  setTimeout(() => URL.revokeObjectURL(url), 1000);
}

export function savePicture(canvases, name) {
  const sheet = document.createElement("canvas");
  compose(sheet, canvases);
  sheet.toBlob((blob) => save(blob, name, "png"));
}

/** Grows with every add(); end() saves it. */
export class Film {
  static get isPossible() { return typeof MediaRecorder === "function" && MediaRecorder.isTypeSupported("video/webm"); }

  constructor(canvases) {
    this.sheet = document.createElement("canvas");
    compose(this.sheet, canvases);  // a size that does not change: the encoder wants one
    this.parts = [];
    this.pictures = 0;
    this.recorder = new MediaRecorder(this.sheet.captureStream(), {mimeType: "video/webm", videoBitsPerSecond: 6e6});
    this.recorder.ondataavailable = ({data}) => this.parts.push(data);
    this.recorder.start(1000);
  }

  add(canvases) {
    compose(this.sheet, canvases);
    ++this.pictures;
  }

  /** @returns a promise of its size [bytes] */
  end(name) {
    return new Promise((resolve) => {
      this.recorder.onstop = () => {
        const film = new Blob(this.parts, {type: "video/webm"});
        save(film, name, "webm");
        resolve(film.size);
      };
      this.recorder.stop();
    });
  }
}
