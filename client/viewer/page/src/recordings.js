// Recordings: the choice among them, the bar of their time, and the making of one.
import {TractionError} from "../../../javascript/traction.js";

import {say} from "./canvas.js";

const $ = (id) => document.getElementById(id);
const clock = (seconds) => `${Math.floor(seconds / 60)}:${(seconds % 60).toFixed(1).padStart(4, "0")}`;

/** The list of what is in traction-view's directory. */
export class Choice {
  /** open(name): that one is wanted; open(null): what is live. */
  constructor(open) {
    this.element = $("recordings");
    this.element.onchange = () => {
      this.element.blur();  // keys are the page's again
      open(this.element.value || null);
    };
    this.element.onfocus = () => this.look();
  }

  async look() {
    const answer = await fetch("recordings");
    if (!answer.ok) return;
    const {recordings} = await answer.json();
    const {value} = this.element;
    const option = (text, name) => Object.assign(document.createElement("option"), {textContent: text, value: name});
    this.element.replaceChildren(option("Live", ""), ...recordings.map(({name, bytes}) => option(`${name.replace(/\.mcap$/, "")}, ${(bytes / 1e6).toFixed(1)} MB`, name)));
    this.element.value = recordings.some(({name}) => name === value) ? value : "";
    this.element.hidden = false;
  }
}

/** Where a recording has got to. Moving it shows that moment. */
export class TimeBar {
  constructor() {
    this.sensor = null;
    this.isMoved = false;
    this.speed = 1;  // before it was moved
    $("play").onclick = () => this.toggle();
    $("at").oninput = () => {
      if (!this.isMoved) this.speed = this.sensor.model.time?.speed ?? 0;
      this.isMoved = true;
      this.go(Number($("at").value), 0);
    };
    $("at").onchange = () => {
      this.isMoved = false;
      $("at").blur();
      if (this.speed > 0) this.go(Number($("at").value), this.speed);
    };
  }

  /** Null: what is shown is live. */
  choose(sensor) {
    this.sensor = sensor;
    $("time").hidden = !sensor;
    this.show();
  }

  show() {
    const time = this.sensor?.model.time;
    if (!time) return;
    const {length_s, at_s, speed} = time;
    Object.assign($("at"), {max: length_s});
    if (!this.isMoved) $("at").value = at_s;
    $("at").setAttribute("aria-valuetext", `${clock(at_s)} of ${clock(length_s)}`);
    say($("time-text"), `${clock(at_s)} / ${clock(length_s)}`);
    $("play").textContent = speed > 0 ? "❚❚" : "▶";
    $("play").setAttribute("aria-label", speed > 0 ? "Stand" : "Play");
  }

  toggle() {
    const {at_s, length_s, speed} = this.sensor.model.time ?? {at_s: 0, length_s: 0, speed: 0};
    this.go(speed === 0 && at_s >= length_s ? 0 : at_s, speed > 0 ? 0 : 1);
  }

  step(seconds) {
    const {at_s, speed} = this.sensor?.model.time ?? {};
    if (at_s !== undefined) this.go(at_s + seconds, speed);
  }

  go(at_s, speed) {
    const {model, subscriber} = this.sensor;
    if (model.time) model.time = {...model.time, at_s: Math.min(Math.max(at_s, 0), model.time.length_s), speed};
    this.sensor.forget();
    subscriber.play(at_s, speed);
    this.show();
  }
}

/** The button that makes one. notice(sentence) tells how it went. */
export class RecordButton {
  constructor(notice) {
    this.notice = notice;
    this.element = $("record");
    this.element.onclick = () => this.toggle();
  }

  choose(sensor) {
    this.sensor = sensor;
    this.element.hidden = !sensor.canRecord;
    this.show();
  }

  show() {
    const {file, account, error} = this.sensor.model.recorder ?? {};
    if (error && error !== this.noticed) this.notice(error);
    this.noticed = error;
    this.element.setAttribute("aria-pressed", String(Boolean(file) && !error));
    this.element.title = file ? `${file}: ${account} (R)` : "Records all that comes, in a file beside traction-view (R)";
  }

  async toggle() {
    if (!this.sensor.canRecord) return;
    const isOn = this.element.getAttribute("aria-pressed") === "true";
    this.element.disabled = true;
    try {
      const said = await (isOn ? this.sensor.subscriber.stopRecording() : this.sensor.subscriber.record());
      this.notice(isOn ? said : `Recording into ${said}`);
    } catch (error) {
      if (!(error instanceof TractionError)) throw error;
      this.notice(error.message);
    } finally {
      this.element.disabled = false;
    }
  }
}
