// Steps 5 and 6: the zero; then noise, stiffness by weights, and the calibrated gel file.
import {digits, figureTable, make, noteList, textField, verdict, verdicts} from "./parts.js";

const gramForce_N = 9.80665e-3, gone = 0.15, patience_s = 120;

/** Needs a gel in the daemon. @returns whether there is one; else it says where to get it */
function hasGel(box, setup) {
  if (setup.sensor.model.description?.layers?.length) return true;
  box.append(make("p", {}, "The daemon has no gel yet: find the pose first, and let it measure with this gel."));
  return false;
}

export const zero = {
  name: "zero",
  title: "Zero",
  isDone: ({steps}) => Boolean(steps.zero),

  show(box, setup) {
    if (!hasGel(box, setup)) return;
    const result = make("div"), trouble = make("p", {class: "fault", role: "alert"});
    const show = ({present, expected, noise_levels, remark, date}) => result.replaceChildren(
      verdicts(verdict(present >= 0.9 * expected ? "good" : "warn", `${present} of ${expected} markers seen`),
        verdict("good", `noise of a pixel ${digits(noise_levels, noise_levels / 20)} levels`), remark && verdict("warn", remark)),
      make("p", {class: "quiet"}, setup.when(date)));
    const take = (anyway) => make("button", {class: anyway ? "" : "main", onclick: async (event) => {
      const reply = await setup.run(event.currentTarget, {do: "zero", anyway}, trouble);
      if (reply) show(setup.took("zero", reply)), trouble.replaceChildren();
      else if (!anyway && trouble.dataset.code === "refused") trouble.append(" ", take(true));
    }}, anyway ? "Nothing touches it: take it anyway" : "Take the zero");
    const live = setup.livePicture();
    box.append(make("p", {}, "Take everything off the gel, leave it for some minutes at its temperature of use, and keep the table still. All forces count from here."), live.element, make("p", {}, take(false)), trouble, result);
    if (setup.state.steps.zero) show(setup.state.steps.zero);
    return live.end;
  },
};

export const weights = {
  name: "weights",
  title: "Weights",
  isDone: ({steps}) => Boolean(steps.finish),

  show(box, setup) {
    if (!hasGel(box, setup)) return;
    const {model} = setup.sensor, {steps} = setup.state;
    let isOpen = true, list = (steps.weights?.read?.map(({gf}) => gf) ?? [100, 200, 500]).join(", "), name = "gel";
    const trouble = make("p", {class: "fault", role: "alert"}), instruction = make("p", {class: "instruction", role: "status"}), reading = make("p", {class: "reading"}), table = make("div"), result = make("div");

    const number = () => list.split(/[\s,;]+/).filter(Boolean).map(Number);
    const showTable = (read = []) => table.replaceChildren(...(read.length ? [make("table", {class: "figures"},
      make("thead", {}, make("tr", {}, ["weight", "read as", "", "at", ""].map((word) => make("th", {scope: "col"}, word)))),
      make("tbody", {}, read.map(({gf, figures, remarks}) => make("tr", {}, make("th", {scope: "row"}, `${digits(gf)} gf`),
        make("td", {}, `${digits(figures.reading_gf.value, figures.reading_gf.deviation)}`), make("td", {}, figures.reading_gf.deviation > 0 ? `± ${figures.reading_gf.deviation.toPrecision(2)} gf` : "gf"),
        make("td", {}, `${figures.x_mm.value.toFixed(1)}, ${figures.y_mm.value.toFixed(1)} mm`), make("td", {}, remarks.join("; ")))))),
    ] : []));
    const showResult = () => {
      const {stiffness, noise, geometry, finish} = setup.state.steps;
      result.replaceChildren(...[stiffness && make("h3", {}, "Stiffness"), stiffness && figureTable(stiffness.figures), stiffness && noteList(stiffness.remarks),
        geometry && make("h3", {}, "Pose, from the zero"), geometry && figureTable(geometry.figures, ["residual_px", "markers", "outliers", "position_z_mm", "focal_px"]),
        noise && make("h3", {}, "Noise"), noise && figureTable(noise.figures, ["noise_px", "noise_over_promised", "shift_px"]),
        finish && make("p", {}, "Written: ", make("code", {}, finish.path ?? ""))].filter(Boolean));
    };
    const force_gf = () => model.field?.valid ? model.field.resultant_N[2] / gramForce_N : NaN;
    const timer = setInterval(() => {
      const now = force_gf(), contact = model.field?.contacts?.[0];
      reading.textContent = Number.isFinite(now) ? `${now.toFixed(1)} gf${contact ? ` at ${contact.position_m.slice(0, 2).map((one) => (1e3 * one).toFixed(1)).join(", ")} mm` : ""}` : "no valid forces";
    }, 150);
    const until = (holds) => new Promise((resolve) => {
      const look = setInterval(() => { if (!isOpen || holds()) clearInterval(look), resolve(isOpen); }, 150);
    });
    const say = (...words) => instruction.replaceChildren(...words);

    /** Each step keeps its result, so that the next try begins where this one has ended. */
    const steps_ = {
      async rest() {
        for (const [step, words] of [["geometry", "Nothing may touch the gel: the pose is measured …"], ["noise", "Leave the gel untouched: its noise is measured …"]]) {
          say(words);
          const reply = await setup.ask({do: "measure", step});
          setup.took(step, reply);
          showResult();
        }
      },
      async creep() {
        say("Creep: in two seconds put a weight on the gel quickly, and let it stand for a minute …");
        setup.took("creep", await setup.ask({do: "measure", step: "creep", seconds: 60}));
        say("Take the weight away quickly, and leave the gel for a minute …");
        setup.took("recovery", await setup.ask({do: "measure", step: "recovery", seconds: 60}));
      },
      async weights() {
        const read = [];
        for (const [i, gf] of number().entries()) {
          say(`Put `, make("b", {}, `${gf} gf`), ` near the middle of the gel, and let go. ${i + 1} of ${number().length}.`);
          const reply = await setup.ask({do: "measure", step: "weight", gf, first: i === 0, seconds: patience_s});
          read.push({...reply, gf});
          setup.took("weights", {read});
          showTable(read);
          say(`${gf} gf read as ${reply.figures.reading_gf.value.toFixed(1)} gf. `, make("b", {}, "Take it away."));
          if (!await until(() => Math.abs(force_gf()) < gone * gf)) return;
        }
        say("The stiffness is computed …");
        setup.took("stiffness", await setup.ask({do: "measure", step: "stiffness"}));
        showResult();
      },
      async finish() {
        setup.took("finish", await setup.ask({do: "measure", step: "finish", name}));
        showResult();
        say("The calibrated gel file is put in force …");
        await setup.ask({do: "adopt", calibrated: true});
        setup.took("adopted", {});
        await setup.awaitGel(null, instruction);
        say("Done: the daemon measures with the calibrated gel. The report is the last step.");
        setup.state = await setup.ask(null);
      },
    };
    const start = (words, names, isMain) => make("button", {class: isMain ? "main" : "", onclick: async () => {
      const buttons = box.querySelectorAll("button.start");
      trouble.textContent = "";
      for (const button of buttons) button.disabled = true;
      cancel.hidden = false;
      try {
        for (const each of names()) if (isOpen) await steps_[each]();
      } catch (error) {
        say("");
        trouble.textContent = setup.words(error);
      } finally {
        cancel.hidden = true;
        for (const button of buttons) button.disabled = false;
      }
    }}, words);
    const cancel = make("button", {hidden: true, onclick: () => setup.ask({do: "cancel"})}, "Cancel");
    const creeps = make("input", {type: "checkbox"});
    const buttons = [start("Measure all", () => ["rest", ...(creeps.checked ? ["creep"] : []), "weights", "finish"], true), start("Pose and noise again", () => ["rest"]),
      start("Weights again", () => ["weights"]), start("Write the gel file", () => ["finish"])];
    for (const button of buttons) button.classList.add("start");
    const listField = textField("Weights, in the order you put them on", "gf", list, (value) => { list = value; });
    const nameField = textField("Name of the gel", "", name, (value) => { name = value; }, {pattern: "[A-Za-z0-9_\\-]{1,24}"});
    const live = setup.livePicture();
    box.append(
      make("p", {}, "Two known weights at least, better three, each on one round contact of 1 to 20 mm, spanning the forces that you want to measure."),
      make("div", {class: "fields"}, listField, nameField), make("p", {}, make("label", {}, creeps, " measure the gel's creep before, which takes two minutes")),
      make("p", {class: "row"}, buttons, cancel), instruction, trouble,
      make("div", {class: "pair"}, make("div", {}, reading, live.element), make("div", {}, table, result)));
    showTable(steps.weights?.read);
    showResult();
    return () => { isOpen = false; clearInterval(timer); live.end(); };
  },
};
