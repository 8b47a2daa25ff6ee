// The viewer's page: what comes goes into a model; what is drawn is the newest of it.
import {Subscriber, TractionError} from "../../../javascript/traction.js";

import {isSlow, say} from "./canvas.js";
import {Contours} from "./contours.js";
import {saveDrawing, savePicture, saveText} from "./export.js";
import {Flow} from "./flow.js";
import {Model} from "./model.js";
import {flagWords, showContacts, showFacts, showForce, showState, showZero} from "./numbers.js";
import {Overhead} from "./overhead.js";
import {History, Plot} from "./plot.js";
import {Choice, RecordButton, TimeBar} from "./recordings.js";
import {Setup} from "./setup/setup.js";
import {Surface} from "./surface.js";
import {directions, onTheme, toggleTheme} from "./theme.js";

const $ = (id) => document.getElementById(id);
const slow_ms = 75;  // between new texts and new plots, in turns: nobody reads faster

class Sensor {
  constructor({name, stream, control = false, record = false, setup = false}) {
    this.name = name;
    this.control = control;
    this.setup = setup && new Setup(this);
    this.canRecord = record;
    this.model = new Model(name);
    this.history = new History();
    this.subscriber = new Subscriber({
      url: new URL(stream, location.href).href,
      topics: ["field", "markers", "description", "status", "picture", "places", "surface", "health", "contacts"],
      onConnected: (is) => { this.model.isConnected = is; },
      onError: (error) => { this.model.error = error.message; },
      onMessage: (message) => this.#take(message),
    });
  }

  /** What was, when time has jumped. */
  forget() {
    this.history = new History();
    this.model.peak = null;
  }

  #take(message) {
    const {model} = this;
    model.error = "";
    switch (message.kind) {
      case "field":
        model.takeField(message);
        this.history.add(message);
        break;
      case "markers": model.takeMarkers(message); break;
      case "contacts": model.takeContacts(message); break;
      case "description":
        if (model.zeroId && String(message.zero?.id) !== model.zeroId) this.history.mark("zero");
        model.takeDescription(message);
        break;
      case "status": model.takeStatus(message); break;
      case "surface": model.takeSurface(message); break;
      case "picture": views.b.show(message, model); return;  // draws when it is decoded
      case "places": model.takePlaces(message); break;
      case "time": model.time = message; break;
      case "recorder": model.recorder = message; break;
      case "health":
        model.health = message;
        if (model.isStale) this.history.interrupt();
        break;
      default: return;
    }
    if (this === chosen) isNew = true;
  }
}

let sensors = [], chosen = null, isNew = true, isHeld = false, slowAt = 0, isPlotsTurn = false;
const works = [];
const redraw = () => { isNew = true; };
const canvasOf = (letter) => $(`view-${letter}`).querySelector("canvas");
const views = {
  a: new Surface(canvasOf("a"), $("scale-a"), redraw),
  b: new Overhead(canvasOf("b"), $("scale-b"), redraw),
  c: new Contours(canvasOf("c"), $("scale-c"), $("legend-c"), redraw),
  d: new Flow(canvasOf("d"), $("scale-d"), redraw),
};
const plot = new Plot($("plot"), $("plot-values"));
const timeBar = new TimeBar(), recordButton = new RecordButton(notice), recordings = new Choice(openRecording);
let played = null;
let owed = null;  // where the processor draws, the two views in three dimensions take turns: the one that waits

function choose(sensor) {
  chosen = sensor;
  isHeld = false;
  $("pause").setAttribute("aria-pressed", "false");
  window.traction.model = sensor.model;
  for (const button of $("sensors").children) button.setAttribute("aria-current", String(button.sensor === sensor));
  for (const id of ["zero", "undo"]) $(id).hidden = !sensor.control;
  $("setup-open").hidden = !sensor.setup;
  recordButton.choose(sensor);
  timeBar.choose(sensor === played ? sensor : null);
  redraw();
}

/** Null: back to what is live. */
function openRecording(name) {
  played?.subscriber.close();
  played = name && new Sensor({name, stream: `recording/${encodeURIComponent(name)}`});
  choose(played ?? sensors[0]);
}

function showTexts(model) {
  model.work_ms = [...works].sort((a, b) => a - b)[works.length >> 1] ?? 0;
  showState(model);
  showFacts(model);
  showZero(model);
  timeBar.show();
  recordButton.show();
  if (!isHeld) {
    showForce(model);
    showContacts(model);
  }
  for (const button of $("sensors").children) button.describe();
}

function draw() {
  requestAnimationFrame(draw);
  if (!chosen) return;
  const {model} = chosen;
  const begin = performance.now();
  if (begin - slowAt > slow_ms) {
    slowAt = begin;
    isPlotsTurn = !isPlotsTurn;
    if (!isPlotsTurn) showTexts(model);
    else if (!isHeld) plot.draw(chosen.history);
  }
  if (isHeld || chosen.setup?.isOpen) return;
  if (!isNew) {
    owed?.draw(model);
    owed = null;
    return;
  }
  isNew = false;
  const shown = Object.values(views).filter(({isShown}) => isShown !== false);
  const takeTurns = isSlow && shown.includes(views.a) && shown.includes(views.d);
  owed = takeTurns ? (owed === views.a ? views.d : views.a) : null;
  for (const view of shown) if (view !== owed) view.draw(model);
  ++model.drawn;
  model.drawn_sequence = model.field?.header.sequence;
  model.last_work_ms = performance.now() - begin;
  works.push(model.last_work_ms);
  if (works.length > 60) works.shift();
}

// Keys and buttons.

function one(letter) {
  const box = $("views");
  const same = box.classList.contains("one") && $(`view-${letter}`)?.classList.contains("chosen");
  box.classList.toggle("one", Boolean(letter) && !same);
  for (const figure of box.children) {
    figure.classList.toggle("chosen", figure.id === `view-${letter}`);
    const view = views[figure.id.at(-1)];
    if (view) view.isShown = !box.classList.contains("one") || figure.classList.contains("chosen");
  }
  redraw();
}

let noticeTimer;
function notice(text) {
  clearTimeout(noticeTimer);
  $("notice").textContent = text;
  $("notice").hidden = false;
  noticeTimer = setTimeout(() => { $("notice").hidden = true; }, 12000);
}

async function ask(what, words) {
  if (!chosen?.control) return;
  for (const id of ["zero", "undo"]) $(id).disabled = true;
  try {
    const {remark} = await chosen.subscriber[what]();
    notice(words + (remark ? `, but: ${remark}` : ""));
  } catch (error) {
    if (!(error instanceof TractionError)) throw error;
    notice(error.message);
  } finally {
    for (const id of ["zero", "undo"]) $(id).disabled = false;
  }
}

function hold() {
  if (played && chosen === played) return timeBar.toggle();
  isHeld = !isHeld;
  $("pause").setAttribute("aria-pressed", String(isHeld));
  redraw();
}

const shownCanvases = () => Object.keys(views).filter((letter) => views[letter].isShown !== false).map(canvasOf);
const nameOfFile = () => chosen.model.field?.header.sensor ?? "traction";

/** With all views as they are. */
function takePicture() {
  for (const view of Object.values(views)) if (view.isShown !== false) view.draw(chosen.model);
  savePicture(shownCanvases(), nameOfFile());
}

const actions = {
  " ": hold, d: toggleTheme, p: takePicture, r: () => recordButton.toggle(),
  ",": () => timeBar.step(-1), ".": () => timeBar.step(1),
  z: () => ask("zero", "The zero has been taken"), u: () => ask("undoZero", "The zero before that one is in force again"),
  0: () => one(null), Escape: () => one(null),
  1: () => one("a"), 2: () => one("b"), 3: () => one("c"), 4: () => one("d"),
  ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0), ArrowUp: () => turn(0, 0.1), ArrowDown: () => turn(0, -0.1),
};

async function toggleSetup() {
  const {setup} = chosen;
  if (setup.isOpen) setup.close();
  else await setup.open().catch((error) => notice(error.message));
  $("setup-open").setAttribute("aria-pressed", String(setup.isOpen));
  redraw();
}

function turn(across, up) {
  for (const view of Object.values(views)) view.stage?.turn(across, up);
}

addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.key === " " && event.target.closest("button")) return;
  if (event.target.closest("input, select, summary") || chosen?.setup?.isOpen) return;
  const action = actions[event.key] ?? actions[event.key.toLowerCase()];
  if (!action) return;
  event.preventDefault();
  action();
});
addEventListener("resize", redraw);
const colourWheel = () => { document.querySelector(".wheel").style.background = directions(); };
onTheme(() => { colourWheel(); redraw(); });
colourWheel();
$("pause").onclick = hold;
$("theme").onclick = toggleTheme;
$("picture").onclick = takePicture;
for (const ending of ["csv", "svg"]) $(ending).onclick = () => saveText(plot[ending](), `${nameOfFile()}-${plot.kind}`, ending);
$("png").onclick = () => saveDrawing(plot.svg(), `${nameOfFile()}-${plot.kind}`);
$("setup-open").onclick = toggleSetup;
$("zero").onclick = actions.z;
$("undo").onclick = actions.u;
for (const figure of $("views").children) {
  figure.ondblclick = () => one(figure.id.at(-1));
  new ResizeObserver(redraw).observe(figure);
}

/** Buttons of which one is pressed: each has a word in its data. */
function choices(name, take) {
  const buttons = document.querySelectorAll(`[data-${name}]`);
  for (const button of buttons) {
    button.onclick = () => {
      take(button.dataset[name]);
      for (const each of buttons) each.setAttribute("aria-pressed", String(each === button));
      redraw();
    };
  }
}
choices("plot", (kind) => plot.choose(kind));
choices("span", (seconds) => plot.look(Number(seconds)));
choices("contours", (quantity) => { views.c.quantity = quantity; });
choices("arrows", (colour) => { views.d.colour = colour; });

function whenConnected(act) {
  if (chosen.model.isConnected) act();
  else setTimeout(() => whenConnected(act), 50);
}

async function start() {
  window.traction = {model: null, views, plot, get sensors() { return sensors.map((sensor) => sensor.model); }};
  const {sensors: list, recordings: hasRecordings, flags} = await (await fetch("sensors")).json();
  Object.assign(flagWords, flags);
  sensors = list.map((entry) => new Sensor(entry));
  if (sensors.length > 1) {
    $("sensors").append(...sensors.map((sensor) => {
      const button = document.createElement("button");
      const label = document.createElement("span"), force = document.createElement("small");
      button.append(label, force);
      button.sensor = sensor;
      button.onclick = () => choose(sensor);
      button.describe = () => {
        const {field} = sensor.model;
        say(label, field?.header.sensor && sensor.name.includes("://") ? field.header.sensor : sensor.name);
        say(force, field?.valid && !sensor.model.isStale ? `${Math.hypot(...field.resultant_N).toFixed(2)} N` : "–");
      };
      return button;
    }));
  }
  choose(sensors[0]);
  if (hasRecordings) await recordings.look();
  if (location.hash === "#setup" && chosen.setup) whenConnected(toggleSetup);
  draw();
}

start().catch((error) => notice(`The page cannot start: ${error.message}`));
