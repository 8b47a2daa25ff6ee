// Step 1: the camera's picture, its focus, exposure, and how large markers are in it.
import {draw, make, numberField, verdict, verdicts} from "./parts.js";

const smallest_px = 2, largest_px = 18, good_px = 3;  // diameters: docs/sensor.md, radii of 1 to 9 px
const leastPitch = 1.75;  // diameters
const mostClipped = 0.001, darkest = 0.25;  // shares of the levels; of the range
const again_ms = 400;

/** What the picture is worth, line by line. */
export function judge({clipped, bright, markers, diameter_px, pitch_px, reduced}) {
  const lines = [];
  if (clipped > mostClipped) lines.push(verdict("bad", `${(100 * clipped).toFixed(1)} % of the picture is overexposed: expose shorter, close the iris, or shield what reflects`));
  else if (bright < darkest) lines.push(verdict("warn", `dark: 99 % is below ${(100 * bright).toFixed(0)} % of the range. Light it more, or expose longer`));
  else lines.push(verdict("good", "exposed well"));
  if (reduced > 1) lines.push(verdict("bad", `more than 16 MB: it comes ${reduced} times reduced, which lens and pose cannot use. Set camera.width_px and height_px to a region`));
  if (!markers) lines.push(verdict("warn", "no markers seen yet: fewer than 16 round spots of one size"));
  else {
    const seen = `${markers} markers, ${diameter_px.toFixed(1)} px wide, ${pitch_px.toFixed(1)} px apart`;
    if (diameter_px < smallest_px) lines.push(verdict("bad", `${seen}: too small, ${smallest_px} px at least. Move nearer, take a longer lens, or larger markers`));
    else if (diameter_px > largest_px) lines.push(verdict("bad", `${seen}: too large, ${largest_px} px at most`));
    else if (pitch_px < leastPitch * diameter_px) lines.push(verdict("bad", `${seen}: too close, ${leastPitch} diameters at least`));
    else if (diameter_px < good_px) lines.push(verdict("warn", `${seen}: can be tracked; 4 px are better`));
    else lines.push(verdict("good", `${seen}: good`));
  }
  return lines;
}

function histogramOf({histogram}) {
  const most = Math.max(1, ...histogram.slice(1, -1).map(Math.sqrt), 1), width = histogram.length;
  return draw("svg", {viewBox: `0 0 ${width} 24`, preserveAspectRatio: "none", role: "img", "aria-label": "Histogram of the levels, dark to bright"},
    ...histogram.map((count, level) => {
      const height = Math.min(24, 24 * Math.sqrt(count) / most);
      return draw("rect", {x: level, y: 24 - height, width: 0.9, height, class: level === width - 1 ? "clipped" : ""});
    }));
}

/** The largest sharpness since the lens was turned last, and now. */
function focusMeter(look, best) {
  const share = best > 0 ? look.sharpness / best : 0;
  return make("div", {class: "meter", role: "meter", "aria-label": "Sharpness against the best so far", "aria-valuemin": 0, "aria-valuemax": 100,
    "aria-valuenow": Math.round(100 * share)}, make("i"), make("span", {}, share > 0.97 ? "sharpest so far" : `${Math.round(100 * share)} % of the sharpest so far`));
}

export const camera = {
  name: "camera",
  title: "Camera",
  isDone: ({steps}) => Boolean(steps.camera),

  show(box, setup) {
    let best = 0, isOpen = true;
    const picture = make("img", {alt: "What the camera sees", class: "picture"}), facts = make("p", {class: "quiet"}, "waiting for a picture …");
    const focus = make("div"), light = make("div", {class: "histogram"}), lines = verdicts(), knobs = make("div", {class: "fields"}), trouble = make("p", {class: "fault", role: "alert"});
    box.append(
      make("p", {}, "Turn the focus ring until the plane of the markers is sharpest, and lock it. Then set the exposure. Size, region and format of the picture hold from here on."),
      make("div", {class: "pair"}, make("div", {}, picture, facts), make("div", {},
        make("h3", {}, "Focus"), focus, make("button", {onclick: () => { best = 0; }}, "Begin the meter anew"),
        make("h3", {}, "Light"), light, knobs, make("h3", {}, "Judgement"), lines)),
      trouble,
      make("p", {class: "quiet"}, "The daemon uses the first camera that it finds. ", make("code", {}, "tractiond --cameras"), " lists all; for another one write its id into ",
        make("code", {}, "camera.id"), " of the configuration and start the daemon again."));

    const look = async () => {
      if (!isOpen || document.hidden) return isOpen && setTimeout(look, again_ms);
      try {
        const seen = await setup.ask({do: "look"});
        if (!isOpen) return;
        best = Math.max(best, seen.sharpness);
        picture.src = `setup/look.jpg?${Date.now()}`;
        facts.textContent = `${[seen.vendor, seen.model, seen.serial].filter(Boolean).join(" ")}: ${seen.width_px} × ${seen.height_px} px, ${seen.pixel_format}`;
        const meter = focusMeter(seen, best);
        meter.firstChild.style.width = `${100 * Math.min(1, best ? seen.sharpness / best : 0)}%`;
        focus.replaceChildren(meter);
        light.replaceChildren(histogramOf(seen));
        lines.replaceChildren(...judge(seen));
        trouble.textContent = "";
        setup.took("camera", seen);
      } catch (error) {
        trouble.textContent = setup.words(error);
      }
      setTimeout(look, again_ms);
    };

    const knob = (feature) => {
      const write = make("button", {onclick: async () => {
        const value = field.querySelector("input").value;
        const reply = await setup.run(write, {do: "camera", name: feature.name, value: String(value)}, trouble);
        if (reply) field.querySelector("input").value = reply.features[0]?.value ?? value;
      }}, "Set");
      const field = numberField(feature.name, feature.unit, feature.value, () => {}, {min: feature.minimum, max: feature.maximum, title: feature.description});
      return make("div", {class: "knob"}, field, write);
    };
    (async () => {
      for (const matching of ["exposure", "gain"]) {
        const {features} = await setup.ask({do: "camera", matching}).catch(() => ({features: []}));
        knobs.append(...features.filter(({kind, access}) => /float|integer/i.test(kind) && /write/i.test(access)).slice(0, 3).map(knob));
      }
      if (knobs.children.length) {
        knobs.after(make("p", {class: "quiet"}, "A setting lasts until the camera is opened again. Keep it: ", make("code", {}, "exposure_us"), " and ",
          make("code", {}, "gain"), " of ", make("code", {}, "[camera]"), " in the configuration."));
      }
      look();
    })();
    return () => { isOpen = false; };
  },
};
