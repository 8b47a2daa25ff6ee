// Contacts and critical points of traction-touch over the views, and how far each contact is from slipping.
import {say, screenPlaces} from "./canvas.js";
import {theme} from "./theme.js";

const words = {sticking: "sticks", incipient: "about to slip", slipping: "slips"};
const colours = {sticking: "good", incipient: "warn", slipping: "bad"};
const points = 40;  // of an ellipse
const reach = 36;  // of the gauge's cone, in its own units

export const isSeen = ({phase}) => phase === "begin" || phase === "move";
export const stateOf = (contact) => contact.slip?.state ?? "unknown";

const glyph = 7;  // half of a critical point's size [px]
const barb = 3;  // of a vortex's arrow: half its width, and its length [px]

/** Makes a critical point of the shear the context's path: a vortex is an arrow that turns as it does, a source a circle around
    a dot, a sink one around a cross, a saddle a cross. */
function trace(context, {kind, angle_rad}) {
  const cross = (half) => {
    for (const side of [-1, 1]) {
      context.moveTo(-half, side * half);
      context.lineTo(half, -side * half);
    }
  };
  context.beginPath();
  if (kind === "saddle") {
    cross(glyph);
  } else if (kind === "vortex") {
    const turn = Math.sign(angle_rad);  // y is up in each view, and down on a canvas
    context.arc(0, 0, glyph, (-turn * Math.PI) / 2, 0, turn > 0);
    context.moveTo(glyph - barb, 0);
    context.lineTo(glyph + barb, 0);
    context.lineTo(glyph, -barb * turn);
    context.closePath();
  } else {
    context.arc(0, 0, glyph, 0, 2 * Math.PI);
    if (kind === "sink") cross(glyph / Math.SQRT2);
    else context.rect(-0.5, -0.5, 1, 1);
  }
}

/**
 * Draws an ellipse and the id of each contact that is seen, or of which this field says nothing, and the critical points of the
 * shear. The colour says whether a contact slips.
 * @param place of a point of the gel frame [m] in the context's units
 * @param unknown colour of those of which that is not known
 * @returns boxes [left, top, right, low] on the screen that have an id or a critical point in them
 */
export function drawTouching(context, model, place, unknown = theme.text) {
  const onScreen = screenPlaces(context, place), {pixels} = onScreen, wide = context.canvas.width / pixels;
  const edge = unknown === theme.text ? theme.card : "#0b1013";  // stands out from what is below
  const taken = [];
  context.save();
  context.setTransform(pixels, 0, 0, pixels, 0, 0);
  context.font = "600 13px system-ui";
  context.textAlign = "left";
  context.textBaseline = "bottom";
  for (const contact of model.tracked ?? []) {
    if (contact.phase === "absent") continue;
    const [x, y] = contact.position_m, [a, b] = contact.half_axes_m.map((half) => half || contact.radius_m);
    const cos = Math.cos(contact.orientation_rad), sin = Math.sin(contact.orientation_rad);
    context.strokeStyle = context.fillStyle = theme[colours[stateOf(contact)]] ?? unknown;
    context.lineWidth = 2;
    context.setLineDash(colours[stateOf(contact)] ? [] : [5, 4]);  // not known
    context.beginPath();
    let right, top;  // of its rim
    for (let i = 0; i < points; ++i) {
      const across = a * Math.cos((2 * Math.PI * i) / points), along = b * Math.sin((2 * Math.PI * i) / points);
      const [u, v] = onScreen([x + cos * across - sin * along, y + sin * across + cos * along]);
      context.lineTo(u, v);
      if (i === 0 || u - v > right - top) [right, top] = [u, v];
    }
    context.closePath();
    context.stroke();
    // Beside it: in its middle is the vortex of one that is turned.
    const written = [String(contact.id), Math.min(right + 2, wide - 24), Math.max(top, 14)];
    context.lineWidth = 3;
    context.setLineDash([]);
    context.strokeStyle = edge;
    context.strokeText(...written);
    context.fillText(...written);
    taken.push([written[1], written[2] - 14, written[1] + 8 * written[0].length, written[2]]);
  }
  context.setLineDash([]);
  context.lineCap = "round";
  for (const point of model.criticalPoints) {
    const [u, v] = onScreen(point.position_m);
    taken.push([u - glyph, v - glyph, u + glyph, v + glyph]);
    context.setTransform(pixels, 0, 0, pixels, pixels * u, pixels * v);
    trace(context, point);
    for (const [width, colour] of [[5, edge], [2, unknown]]) {
      context.lineWidth = width;
      context.strokeStyle = colour;
      context.stroke();
    }
  }
  context.restore();
  return taken;
}

const at = (ratio) => {
  const angle = Math.atan(ratio);
  return [(reach * Math.sin(angle)).toFixed(1), (-reach * Math.cos(angle)).toFixed(1)];
};
function cone(friction) {
  const [x, y] = at(friction);
  return `M0 0L${-x} ${y}A${reach} ${reach} 0 0 1 ${x} ${y}Z`;
}

/** A row of the list: the force within the friction cone, and in words. */
export function makeRow() {
  const row = document.createElement("li");
  row.className = "tracked";
  row.innerHTML = `<svg viewBox="-37 -37 74 38" aria-hidden="true"><path class="possible"/><path class="sure"/><path class="force"/></svg>` +
    "<b></b><span></span><small></small><em></em>";
  return row;
}

export function showRow(row, contact) {
  const [drawing, id, force, age, state] = row.children;
  const [x, y, z] = contact.force_N, shear = Math.hypot(x, y), known = stateOf(contact), slip = known === "unknown" ? null : contact.slip;
  const [possible, sure, needle] = drawing.children;
  const isPressed = isSeen(contact) && z > 0;
  possible.setAttribute("d", slip ? cone(slip.friction.high) : "");
  sure.setAttribute("d", slip ? cone(slip.friction.low) : "");
  needle.setAttribute("d", isPressed ? `M0 0L${at(shear / z).join(" ")}` : "");
  say(id, String(contact.id));
  say(force, isSeen(contact) ? `${Math.hypot(shear, z).toFixed(2)} N` : "–");
  say(age, `${(Number(contact.seen_ns - contact.begun_ns) / 1e9).toFixed(1)} s`);
  const {low, high, estimate} = slip?.friction ?? {};
  say(state, !isSeen(contact) ? (contact.phase === "absent" ? "absent" : "no valid field") : !slip ? "slip unknown" : `${words[known]} · stick ratio ${slip.stick_ratio.estimate.toFixed(2)}\n` +
    (high >= 3 ? `friction ≥ ${low.toFixed(2)}` : `friction ${estimate.toFixed(2)} (${low.toFixed(2)} – ${high.toFixed(2)})`));
  row.dataset.state = isSeen(contact) ? known : "absent";
}
