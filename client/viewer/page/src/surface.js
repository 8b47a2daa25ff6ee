// View a: the touched surface itself as the forces deform it. How deep it is pressed is drawn larger than it is; the axis and
// the scale say how much. Of a body, whose surface is not computed, where the forces are.
import {Axes} from "./axes.js";
import {say} from "./canvas.js";
import {Scale, newtons} from "./scale.js";
import {Stage} from "./scene.js";
import {Skin} from "./skin.js";

const height = 0.16;  // of the longer side: the full depth
const mostNodes = 2000;  // as in client/viewer/surface.cpp

export class Surface {
  constructor(canvas, label, redraw) {
    this.stage = new Stage(canvas, label, redraw);
    this.label = label;
    this.scale = new Scale(0.02);  // [mm]
    this.force = new Scale(0.01);
    this.skin = new Skin();
    this.axes = new Axes();
    this.stage.gel.add(this.skin, this.axes);
  }

  draw(model) {
    const {stage, skin, axes} = this, {description} = model;
    stage.gel.visible = description !== null && model.columns > 1 && model.rows > 1;
    if (!stage.renderer || !stage.gel.visible) return say(this.label, ""), stage.render();
    const moved = model.displacement_mm, isMoved = moved.length === model.positions_mm.length;
    let deepest = 0, largest = 0;
    for (const inwards of isMoved ? skin.inwards(model) : []) {
      largest = Math.max(largest, Math.abs(inwards));
      deepest = Math.max(deepest, inwards);
    }
    const full = this.scale.update(largest), side = 1e3 * description.nodes.pitch_m * (Math.max(model.columns, model.rows) - 1);
    const exaggeration = Math.max(1, (height * side) / full);
    let ofBody = null, words = `${deepest.toFixed(2)} mm deep, drawn × ${Number(exaggeration.toPrecision(2))}`;
    if (description.body && model.isComplete) {
      const {magnitude_N, largest_N} = model.arrowGrid, most = this.force.update(largest_N);
      if (magnitude_N.length === model.columns * model.rows) ofBody = magnitude_N.map((one) => one / most);
      words = `${model.ghostWords}orange ${newtons(most)} a node`;
    } else if (!isMoved) {
      words = model.columns * model.rows > mostNodes ? `not known of more than ${mostNodes} nodes` : "";
    } else if (model.surface_share < 1) {
      words = `half space yet, gel ${Math.floor(100 * model.surface_share)} %: ${words}`;
    }
    skin.update(model, exaggeration, full, stage.toEye, ofBody);
    axes.visible = !description.body;
    axes.update(skin.extent, stage, {value_mm: full, drawn_mm: exaggeration * full});
    stage.follow(axes.extent);
    model.surface = {deepest_mm: deepest};
    say(this.label, words);
    stage.render();
  }
}
