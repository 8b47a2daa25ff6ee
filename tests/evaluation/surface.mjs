// What the viewer's page makes of the touched surface where contacts are round. A line of JSON from stdin, {columns, rows, description,
// places_mm, frames: [{contacts, displacement_mm}]}, is answered with, for each frame, {beside, under}: of the nodes without what the
// contacts' forces there do, and of the places under the contacts as balls [mm, inwards]. usage: node surface.mjs
import {readFileSync} from "node:fs";

import {PressedSurface, roundContacts} from "../../client/viewer/page/src/round.js";

const {frames, places_mm, ...model} = JSON.parse(readFileSync(0, "utf8")), surface = new PressedSurface();
console.log(JSON.stringify(frames.map(({contacts, displacement_mm}) => {
  const rounds = roundContacts({contacts}, model.description);
  return {
    beside: Array.from(surface.beside(rounds, {...model, displacement_mm})),
    under: places_mm.map(([x, y]) => rounds.reduce((sum, contact) => sum + surface.under(contact, x, y), 0)),
  };
})));
