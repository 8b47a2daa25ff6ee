// The guided setup: from a camera to a calibrated gel. traction-view and the daemon do the work; what each step has found is
// kept by traction-view, so that any step can be left and taken up again.
import {TractionError} from "../../../../javascript/traction.js";

import {camera} from "./camera.js";
import {gel} from "./gel.js";
import {lens} from "./lens.js";
import {make, when} from "./parts.js";
import {pose} from "./pose.js";
import {report} from "./report.js";
import {weights, zero} from "./weights.js";

const steps = [camera, lens, gel, pose, zero, weights, report];
/** What is kept of each step. */
const kept = {lens: ["lens"], gel: ["gel"], pose: ["pose", "tried"], zero: ["zero"], weights: ["geometry", "noise", "weights", "stiffness", "finish"], report: ["adopted"]};
const longest_ms = 300_000;  // for the factors of a gel

export class Setup {
  #leave = null;
  #turn = 0;

  /** @param sensor of the page */
  constructor(sensor) {
    this.sensor = sensor;
    this.state = {steps: {}, stale: {}, boards: [], files: [], folder: ""};
    this.when = when;
    this.tabs = steps.map((step, i) => make("button", {role: "tab", id: `step-${step.name}`, "aria-controls": "step", onclick: () => this.show(i)}, make("span", {class: "number"}, String(i + 1)), make("span", {class: "title"}, step.title)));
    this.box = make("div", {id: "step", role: "tabpanel", tabindex: "-1"});
    this.element = make("section", {id: "setup", role: "main", "aria-label": "Setup"}, make("div", {role: "tablist", "aria-label": "Steps of the setup", onkeydown: (event) => this.#key(event)}, this.tabs), this.box);
  }

  get isOpen() { return this.element.isConnected; }

  /** Opens at the first step that is not done. */
  async open() {
    document.querySelector("main").before(this.element);
    document.body.classList.add("setting-up");
    this.state = await this.ask(null);
    for (let waits = 0; !this.sensor.model.description && waits < 20; ++waits) await new Promise((resolve) => setTimeout(resolve, 100));
    const first = steps.findIndex((step) => step !== lens && !step.isDone(this.state));
    this.show(first < 0 ? steps.length - 1 : first);
  }

  close() {
    this.#leave?.();
    this.#leave = null;
    this.element.remove();
    document.body.classList.remove("setting-up");
  }

  show(i) {
    this.#leave?.();
    this.#leave = null;
    const turn = ++this.#turn;
    this.box.replaceChildren(make("h2", {}, steps[i].title));
    this.at = i;
    this.#mark();
    const why = kept[steps[i].name]?.map((name) => this.state.stale[name]?.why).find(Boolean);
    if (why) this.box.append(make("p", {class: "fault stale", role: "status"}, `To be repeated: ${why}.`));
    this.box.setAttribute("aria-labelledby", `step-${steps[i].name}`);
    const leave = steps[i].show(this.box, this);
    if (typeof leave === "function") this.#leave = leave;
    Promise.resolve(leave).then(() => {
      if (turn !== this.#turn) return;
      if (i + 1 < steps.length) this.box.append(make("p", {class: "next"}, make("button", {onclick: () => this.show(i + 1)}, `${steps[i + 1].title} →`)));
    });
  }

  #mark() {
    this.tabs.forEach((tab, j) => {
      tab.setAttribute("aria-selected", String(j === this.at));
      tab.tabIndex = j === this.at ? 0 : -1;
      tab.classList.toggle("done", steps[j].isDone(this.state));
    });
  }

  #key(event) {
    const turn = {ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1}[event.key];
    if (!turn) return;
    event.preventDefault();
    event.stopPropagation();
    this.show((this.at + turn + steps.length) % steps.length);
    this.tabs[this.at].focus();
  }

  // For the steps.

  /** Carries out a step, and resolves with its result. @param request null: asks what there is */
  ask(request) { return this.sensor.subscriber.setup(request); }

  /** Carries out a step while its button is disabled. @returns its result; null: it failed, which `trouble` says, and the
   * error's code, its data-code */
  async run(button, request, trouble) {
    button.disabled = true;
    button.setAttribute("aria-busy", "true");
    trouble.textContent = "";
    delete trouble.dataset.code;
    try {
      return await this.ask(request);
    } catch (error) {
      trouble.textContent = this.words(error);
      trouble.dataset.code = error.code;
      return null;
    } finally {
      button.disabled = false;
      button.removeAttribute("aria-busy");
    }
  }

  words(error) {
    if (!(error instanceof TractionError)) throw error;
    return error.message;
  }

  /** What a step has found, as traction-view has kept it; steps that were made from what was there before hold no more.
   * @returns the result with its date */
  took(step, result) {
    this.state.steps[step] = {...result, date: new Date().toISOString()};
    delete this.state.stale[step];
    this.box.querySelector(".stale")?.remove();
    this.#mark();
    this.ask(null).then((state) => {
      this.state = state;
      this.#mark();
    }, () => {});
    return this.state.steps[step];
  }

  /** Waits until the daemon measures with the gel that was adopted. @param status element that says how long it has waited */
  async awaitGel(button, status) {
    const {model} = this.sensor, begin = performance.now();
    const before = String(model.description?.header.boot ?? "");
    if (button) button.disabled = true;
    for (let fields = Infinity; performance.now() - begin < longest_ms;) {
      await new Promise((resolve) => setTimeout(resolve, 300));
      const isNew = Boolean(model.description?.layers?.length) && String(model.description.header.boot) !== before;
      if (isNew && fields === Infinity) ({fields} = model);
      if (model.fields > fields) break;
      status.textContent = `The daemon starts again with this gel (${Math.round((performance.now() - begin) / 1e3)} s) … ${model.health?.problems?.[0] ?? ""}`;
    }
    status.textContent = "";
    if (button) button.disabled = false;
    this.state = await this.ask(null);
    // A setting of the camera lasts until it is opened again.
    const {date: _, ...settings} = this.state.steps.settings ?? {};
    for (const [name, value] of Object.entries(settings)) await this.ask({do: "camera", name, value}).catch(() => {});
    this.#mark();
  }

  /** The reduced pictures that come anyway. @returns their element, and what ends them */
  livePicture() {
    const canvas = make("canvas", {class: "picture", role: "img", "aria-label": "What the camera sees, live"});
    let number = 0, turn = 0;
    const draw = () => {
      turn = requestAnimationFrame(draw);
      const {preview} = this.sensor.model;
      if (!preview || preview.number === number) return;
      number = preview.number;
      if (canvas.width !== preview.width) Object.assign(canvas, {width: preview.width, height: preview.height});
      canvas.getContext("2d").drawImage(preview.canvas, 0, 0);
    };
    draw();
    return {element: canvas, end: () => cancelAnimationFrame(turn)};
  }
}
