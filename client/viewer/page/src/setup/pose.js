// Step 4: one picture of the untouched gel: its markers, where the camera is, and what does not fit.
import {figureTable, make, noteList, numberField} from "./parts.js";

export const pose = {
  name: "pose",
  title: "Pose",
  isDone: ({steps}) => Boolean(steps.tried),

  show(box, setup) {
    const result = make("div"), trouble = make("p", {class: "fault", role: "alert"}), status = make("p", {class: "quiet", role: "status"});
    const live = setup.livePicture();
    let accepted_px = 0.5, sameLens = false;
    const marked = (seen) => seen && make("figure", {class: "marked"}, make("img", {src: `setup/marked.png?${Date.now()}`, class: "picture", alt: "The picture with a ring around each marker found and a cross where one is missing"}),
      make("figcaption", {}, "a ring around each marker that was found, a cross where one is missing"));
    const show = ({figures, notes, fault, picture, marked: words, date}) => {
      const isFit = Boolean(figures);
      live.element.hidden = true;
      find.textContent = "Take another picture";
      const use = isFit && make("button", {class: "main", onclick: async () => {
        if (await setup.run(use, {do: "adopt"}, trouble)) {
          setup.took("tried", {});
          await setup.awaitGel(use, status);
        }
      }}, "Measure with this gel");
      result.replaceChildren(...[
        isFit ? make("h3", {}, "The camera, with standard deviations") : make("h3", {}, "This gel is not what the picture shows"),
        fault && make("p", {class: "fault"}, fault),
        make("div", {class: "pair"}, make("div", {}, marked(picture), noteList(words)), make("div", {}, isFit && figureTable(figures), noteList(notes))),
        fault && /residual|px are left/.test(fault) && make("div", {class: "fields"}, numberField("Accept a residual of up to", "px", accepted_px, (value) => { accepted_px = value; }, {min: 0.5, max: 100})),
        fault?.includes("--same-lens") && make("p", {}, make("button", {onclick: () => {
          sameLens = true;
          find.click();
        }}, "It is the same lens, on another camera")),
        use && make("p", {}, use, " ", make("span", {class: "quiet"}, "The daemon keeps this gel file and starts again with it; a new gel takes some seconds.")),
        date && make("p", {class: "quiet"}, setup.when(date)),
      ].filter(Boolean));
    };
    const find = make("button", {class: "main", onclick: async () => {
      const reply = await setup.run(find, {do: "pose", accept_residual_px: accepted_px, same_lens: sameLens}, trouble);
      if (!reply) return;
      show(reply.figures ? setup.took("pose", reply) : reply);
    }}, "Take a picture and find the markers");
    box.append(make("p", {}, "Mount gel and camera. Nothing may touch the gel."), live.element, make("p", {}, find), trouble, status, result);
    if (setup.state.steps.pose) show(setup.state.steps.pose);
    return live.end;
  },
};
