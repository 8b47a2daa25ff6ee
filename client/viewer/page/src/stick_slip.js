// What the nodes under a contact show of stick and slip: shear over normal force, as a share of the contact's friction. 0: no shear;
// 1: it slips there.
import {screenPlaces} from "./canvas.js";
import {slipRampAt} from "./theme.js";
import {isSeen, stateOf} from "./touching.js";

const sure = 3;  // deviations from which on a normal force is sure, as in the clients' shearRatio()
const vague = 0.25;  // deviation of a share from which on it says nothing: its 95 % interval is as wide as the scale
const most_px = 7, least_px = 2;  // radius of a mark
const dark = "#0b1013", light = "#ffffff";  // around a mark: stands out from any colour of the contours

/** Of a share of the friction; grey where it is not known. @returns red, green, blue in 0 ... 1 */
export const slipColourAt = (share) => (share == null ? [0.55, 0.55, 0.55] : slipRampAt(share));
const colourOf = (share) => `rgb(${slipRampAt(share).map((one) => Math.round(255 * one)).join(" ")})`;
/** CSS, for a legend. */
export const gradient = `linear-gradient(90deg, ${Array.from({length: 8}, (_, i) => colourOf(i / 7)).join(", ")})`;

/** Which friction of a contact is known, with its deviation; null: of none. */
function frictionOf(contact) {
  if (stateOf(contact) === "unknown") return null;
  const {estimate, low, high} = contact.slip.friction;
  return {estimate, deviation: (high - low) / (2 * 1.96)};
}

/** The share of a node, or null: not known. */
function shareOf({force_N, node_deviation_N}, node, friction) {
  const [x, y, normal] = force_N.subarray(3 * node, 3 * node + 3);
  const [ofX, ofY, ofNormal] = node_deviation_N.subarray(3 * node, 3 * node + 3);
  if (!friction || !(normal > sure * ofNormal)) return null;  // where deviations are not stated, too
  const shear = Math.hypot(x, y), ratio = shear / normal, share = ratio / friction.estimate;
  const across = shear > 0 ? Math.hypot(x * ofX, y * ofY) / shear : Math.max(ofX, ofY);
  const deviation = Math.hypot(across / normal, ratio * ofNormal / normal, share * friction.deviation) / friction.estimate;
  return deviation < vague ? share : null;
}

/** The nodes under the contacts of traction-touch, each with its share. */
function nodesOf(model) {
  const found = [], {description: {nodes: {pitch_m}}, field, positions_mm} = model;
  for (const contact of (model.tracked ?? []).filter(isSeen)) {
    const friction = frictionOf(contact), [x, y] = contact.position_m;
    const cos = Math.cos(contact.orientation_rad), sin = Math.sin(contact.orientation_rad);
    const [a, b] = contact.half_axes_m.map((half) => (half || contact.radius_m) + pitch_m / 2);  // a node stands for what is around it
    for (let node = 0; 3 * node < positions_mm.length; ++node) {
      const dx = positions_mm[3 * node] / 1e3 - x, dy = positions_mm[3 * node + 1] / 1e3 - y;
      if (((cos * dx + sin * dy) / a) ** 2 + ((cos * dy - sin * dx) / b) ** 2 > 1) continue;
      found.push({node, contact: contact.id, share: shareOf(field, node, friction)});
    }
  }
  return found;
}

/** The share of each node under a contact, by its index; null: not known. */
export const sharesOf = (model) => new Map(nodesOf(model).map(({node, share}) => [node, share]));

/**
 * Draws a disc at each node under a contact, in the colour of its share; a hollow square where that is not known; nothing
 * where it is known of no node.
 * @param place of a point of the gel frame [m] in the context's units
 * @returns what was drawn
 */
export function drawStickSlip(context, model, place) {
  const {positions_mm, description: {nodes: {pitch_m}}} = model;
  const onScreen = screenPlaces(context, place), [[left], [right]] = [onScreen([0, 0]), onScreen([pitch_m, 0])];
  const drawn = nodesOf(model);
  if (drawn.every(({share}) => share === null)) return [];
  const radius = Math.min(Math.max(0.3 * (right - left), least_px), most_px);
  context.save();
  context.resetTransform();
  context.scale(onScreen.pixels, onScreen.pixels);
  for (const one of drawn) {
    const {node, share} = one, [u, v] = one.at_px = onScreen([positions_mm[3 * node] / 1e3, positions_mm[3 * node + 1] / 1e3]);
    context.beginPath();
    if (share === null) context.rect(u - 0.8 * radius, v - 0.8 * radius, 1.6 * radius, 1.6 * radius);
    else context.arc(u, v, radius, 0, 7);
    for (const [width, colour] of [[Math.min(5, radius), dark], [Math.min(2, 0.45 * radius), light]]) {
      context.lineWidth = width;
      context.strokeStyle = colour;
      context.stroke();
    }
    if (share === null) continue;
    context.fillStyle = colourOf(share);
    context.fill();
  }
  context.restore();
  return drawn;
}
