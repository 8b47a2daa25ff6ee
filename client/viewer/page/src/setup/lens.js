// Step 2: pictures of a chessboard, and the lens that they show.
import {draw, figureTable, make, noteList, numberField} from "./parts.js";

const wanted = 15;
const look_ms = 250, still_ms = 900;
const still = 1.2, fresh = 7;  // mean differences of small pictures [levels]: of a board that is held; of one that has moved

/** Tells whether the board is held still, and lies otherwise than in the last picture, by the small pictures that come anyway. */
class Watch {
  constructor(model) {
    this.model = model;
    this.canvas = Object.assign(document.createElement("canvas"), {width: 48, height: 36});
    this.context = this.canvas.getContext("2d", {willReadFrequently: true});
    this.since = performance.now();
  }

  #levels() {
    if (!this.model.preview) return null;
    this.context.drawImage(this.model.preview.canvas, 0, 0, 48, 36);
    return this.context.getImageData(0, 0, 48, 36).data.slice();
  }

  static #apart(one, other) {
    let sum = 0;
    for (let i = 0; i < one.length; i += 4) sum += Math.abs(one[i + 1] - other[i + 1]);
    return sum / (one.length / 4);
  }

  /** @returns "moves", "same" or "new" */
  look() {
    const now = this.#levels(), number = this.model.preview?.number;
    if (!now || number === this.number) return this.said ?? "moves";
    if (!this.last || Watch.#apart(now, this.last) > still) this.since = performance.now();
    this.last = now;
    this.number = number;
    if (performance.now() - this.since < still_ms) return (this.said = "moves");
    return (this.said = this.taken && Watch.#apart(now, this.taken) < fresh ? "same" : "new");
  }

  took() { this.taken = this.last; }
}

export const lens = {
  name: "lens",
  title: "Lens",
  isDone: ({steps}) => Boolean(steps.lens),

  show(box, setup) {
    const {steps, boards} = setup.state, board = {columns: steps.lens?.squares?.[0] ?? 10, rows: steps.lens?.squares?.[1] ?? 7,
      square_mm: steps.lens?.square_mm?.[0] ?? 10, square_v_mm: steps.lens?.square_mm?.[1] ?? 10};
    const count = make("strong"), gallery = make("div", {class: "gallery"}), trouble = make("p", {class: "fault", role: "alert"}), result = make("div"), says = make("span", {class: "quiet", role: "status"});
    const fill = (names) => {
      setup.state.boards = names;
      count.textContent = `${names.length} of ${wanted} pictures`;
      gallery.replaceChildren(...names.map((name) => make("figure", {}, make("img", {src: `setup/${name}`, alt: name, loading: "lazy"}),
        make("button", {"aria-label": `Remove ${name}`, title: "Remove this picture", onclick: async (event) => {
          const reply = await setup.run(event.currentTarget, {do: "forget", name}, trouble);
          if (reply) fill(reply.boards);
        }}, "×"), make("figcaption", {}, name.replace(/\D/g, "")))));
      fit.disabled = names.length < 5;
      covered();
    };
    // Where boards were seen: the corners of the picture want some, too.
    const cover = make("div", {class: "cover"}), outlines = {...steps.outlines};
    const covered = () => {
      const {width_px = 640, height_px = 480} = steps.camera ?? {};
      cover.replaceChildren(live.element, draw("svg", {viewBox: `0 0 ${width_px} ${height_px}`, "aria-hidden": "true"},
        ...setup.state.boards.filter((name) => outlines[name]?.length === 8).map((name) => draw("polygon", {points: outlines[name].join(" ")}))));
    };
    const live = setup.livePicture();
    const watch = new Watch(setup.sensor.model);
    const take = make("button", {class: "main", onclick: async () => {
      const reply = await setup.run(take, {do: "board", columns: board.columns, rows: board.rows}, trouble);
      watch.took();
      if (reply) Object.assign(outlines, reply.outlines), fill(reply.boards);
    }}, "Take a picture");
    const byItself = make("input", {type: "checkbox"});
    const show = ({figures, notes, pictures, date} = {}) => result.replaceChildren(...(figures ? [make("h3", {}, `The lens, of ${pictures} pictures`),
      figureTable(figures), noteList(notes), make("p", {class: "quiet"}, setup.when(date))] : []));
    const fit = make("button", {class: "main", onclick: async () => {
      const reply = await setup.run(fit, {do: "lens", ...board}, trouble);
      if (reply) show(setup.took("lens", reply));
    }}, "Compute the lens");
    const number = (label, unit, key) => numberField(label, unit, board[key], (value) => { board[key] = value; });
    box.append(
      make("p", {}, "Print a chessboard, glue it on glass, and show it to the camera at the distance of the markers: whole in each picture, tilted by 20 to 45° to each side in turn, from the middle up to the corners."),
      make("div", {class: "fields"}, number("Squares along the rows", "", "columns"), number("along the columns", "", "rows"),
        number("Side of a square along the rows", "mm", "square_mm"), number("along the columns", "mm", "square_v_mm")),
      make("p", {class: "quiet"}, "Measure ten squares along both sides, and write a tenth of both: printers stretch."),
      make("div", {class: "pair"}, cover, make("div", {}, make("p", {}, count), make("p", {}, take, " ", make("label", {}, byItself, " by itself, when the board is still in a new place")), says, gallery)),
      make("p", {}, fit), trouble, result,
      make("p", {class: "quiet"}, "No chessboard at hand? Go on: the next step takes the data sheet's focal length, and forces are then less exact."));
    fill(boards);
    show(steps.lens);
    const timer = setInterval(() => {
      const seen = watch.look();
      if (byItself.checked) says.textContent = {moves: "it moves", same: "still, but as in the last picture: move it", new: "taking it"}[seen];
      else says.textContent = "";
      if (byItself.checked && seen === "new" && !take.disabled && setup.state.boards.length < wanted) take.click();
    }, look_ms);
    return () => { clearInterval(timer); live.end(); };
  },
};
