// What the steps of the setup are made of: elements, fields, tables of figures, verdicts.

/** Makes an element. Attributes that are functions are listeners; null, undefined and false are left out. */
export function make(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (typeof value === "function") made[key] = value;
    else if (value !== null && value !== undefined && value !== false) made.setAttribute(key, value === true ? "" : value);
  }
  made.append(...children.flat().filter((child) => child !== null && child !== undefined && child !== false));
  return made;
}

/** Makes an element of a drawing. */
export function draw(name, attributes = {}, ...children) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

const field = (label, title, ...value) => make("label", {class: "field", title}, make("span", {}, label), make("span", {class: "value"}, ...value));

/** A labelled number. @param take called with each number that is typed; NaN: it is none */
export function numberField(label, unit, value, take, {min, max, step = "any", title} = {}) {
  const input = make("input", {type: "number", inputmode: "decimal", min, max, step, value: value ?? "",
    oninput: () => take(input.value === "" ? NaN : Number(input.value))});
  return field(label, title, input, make("small", {}, unit));
}

/** A labelled text. */
export function textField(label, unit, value, take, attributes = {}) {
  const input = make("input", {value, oninput: () => take(input.value), ...attributes});
  return field(label, undefined, input, make("small", {}, unit));
}

/** A labelled choice. @param choices {value: words} */
export function choiceField(label, choices, value, take, title) {
  const select = make("select", {onchange: () => take(select.value)},
    Object.entries(choices).map(([key, words]) => make("option", {value: key, selected: key === value}, words)));
  return field(label, title, select);
}

/** One line of judgement. @param grade "good", "warn" or "bad" */
export const verdict = (grade, ...words) => make("li", {class: grade}, make("span", {class: `lamp ${grade}`}), make("span", {}, ...words));
export const verdicts = (...lines) => make("ul", {class: "verdicts"}, ...lines);

/** 12.34567 as digits that its deviation leaves. */
export function digits(value, deviation) {
  if (!Number.isFinite(value)) return "–";
  if (deviation > 0) return value.toFixed(Math.min(8, Math.max(0, 1 - Math.floor(Math.log10(deviation)))));
  return String(Number(value.toPrecision(4)));
}

const units = {gf: "gf", px: "px", mm: "mm", rad: "rad", pa: "Pa", s: "s"};

/** "position_x_mm" as ["position x", "mm"]. */
export function named(name) {
  const words = name.split("_"), unit = units[words.at(-1)];
  if (unit && words.length > 1) words.pop();
  return [words.join(" "), unit ?? ""];
}

/** Figures as an array, of traction-lens, or as an object, of the daemon. */
export const listed = (figures) => Array.isArray(figures) ? figures
  : Object.entries(figures ?? {}).map(([name, {value, deviation}]) => ({name, value, deviation}));

/** A table of figures with their standard deviations. @param names those to show; none: all */
export function figureTable(figures, names = null) {
  const rows = listed(figures).filter(({name}) => !names || names.includes(name));
  if (rows.length === 0) return null;
  return make("table", {class: "figures"}, make("tbody", {}, rows.map(({name, value, deviation, unit}) => {
    const [words, ending] = named(name);
    return make("tr", {}, make("th", {scope: "row"}, words), make("td", {}, digits(value, deviation)),
      make("td", {}, deviation > 0 ? `± ${Number(deviation.toPrecision(2))}` : ""), make("td", {}, unit || ending));
  })));
}

export const noteList = (notes) => notes?.length ? make("ul", {class: "notes"}, notes.map((note) => make("li", {}, note))) : null;

/** "2026-11-20 09:15" of an ISO date. */
export const when = (date) => date ? new Date(date).toLocaleString(undefined, {dateStyle: "medium", timeStyle: "short"}) : "–";
