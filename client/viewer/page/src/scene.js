// What the views in three dimensions share: a renderer that draws when something is new, and a camera that keeps what is
// touched in view and is turned by hand. Millimetres; the gel frame's z, into the gel, points down on the screen.
import {AmbientLight, Box3, ColorManagement, DirectionalLight, Group, LinearSRGBColorSpace, PerspectiveCamera, Scene, Vector3,
  WebGLRenderer} from "three";
import {OrbitControls} from "three/addons/controls/OrbitControls.js";

import {isSlow, ratio, say, sizeOf} from "./canvas.js";
import {onTheme, theme} from "./theme.js";

ColorManagement.enabled = false;  // colours are the screen's from the start, and no pixel is converted

/** Where the light comes from, in the scene: x to the right, y away, z up. */
export const sunlight = [-0.52, 0.347, 0.78];

const from = new Vector3(0.1, -0.72, 0.62).normalize();  // where the camera stands at first, seen from what it looks at
const settle_ms = 220;  // in which the camera goes two thirds of its way
const most_ms = 200;  // of a step: a page that was hidden does not jump
const slack = 0.08;  // of the box, by which what is touched may move or grow beyond it, and half as much again by which it may shrink
const arrived = 0.004;  // of the box
const margin = 1.04;  // around it

export class Stage {
  #wanted = new Box3();  // what is to be in view
  #shown = new Box3();   // what is in view
  #distance = 0;  // of the camera, as it was set last
  #byHand = 1;  // times that distance
  #drawn_ms = 0;
  isSettled = false;  // what is wanted is in view

  /** @param redraw is called when the camera or the colours have changed */
  constructor(canvas, label, redraw) {
    this.canvas = canvas;
    this.label = label;
    this.redraw = redraw;
    try {
      // Without alpha the browser puts it there as it is; three.js would ask for alpha.
      const context = canvas.getContext("webgl2", {alpha: false, antialias: !isSlow, powerPreference: "low-power"});
      this.renderer = new WebGLRenderer({canvas, context});
      this.renderer.outputColorSpace = LinearSRGBColorSpace;
    } catch {
      this.renderer = null;  // the page's other half is seen all the same
    }
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(32, 1, 1, 2000);
    this.camera.up.set(0, 0, 1);
    this.camera.position.copy(from);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.enablePan = false;
    this.controls.maxPolarAngle = 1.5;
    this.controls.addEventListener("change", redraw);
    this.gel = new Group();  // in the gel frame; x to the right, y up in the picture, z away from who presses
    this.gel.scale.z = -1;
    this.scene.add(this.gel);
    const sun = new DirectionalLight(0xffffff, 1.6);
    sun.position.fromArray(sunlight);
    const front = new DirectionalLight(0xffffff, 1.1);  // what faces the camera is not black
    front.position.set(0.35, -0.8, 0.5);
    this.scene.add(new AmbientLight(0xffffff, 1.5), sun, front);
    const clear = () => this.renderer?.setClearColor(theme.card);
    onTheme(() => { clear(); redraw(); });
    clear();
  }

  /**
   * Brings a box of the gel frame [mm] into view: smoothly, and only when it is no longer well in view.
   * @param least its size [mm] at least, along the surface
   */
  follow({min, max}, least = 0) {
    const box = new Box3(new Vector3(min[0], min[1], -max[2]), new Vector3(max[0], max[1], -min[2]));
    const size = box.getSize(new Vector3()), lacks = (axis) => 0.5 * Math.max(0, least - size[axis]);
    box.expandByVector(new Vector3(lacks("x"), lacks("y"), 0));
    const wanted = this.#wanted, room = slack * wanted.getSize(size).length(), isFirst = wanted.isEmpty();
    const isShrunk = box.getSize(new Vector3()).length() < (1 - 1.5 * slack) * size.length();
    if (!isFirst && !isShrunk && wanted.clone().expandByScalar(room).containsBox(box)) return;
    wanted.copy(box);
    if (isFirst) this.#shown.copy(box);
  }

  /** Unit vector from what is looked at to the camera. */
  get toEye() {
    return this.camera.position.clone().sub(this.controls.target).normalize();
  }

  /** By the keyboard [rad]. */
  turn(across, up) {
    const offset = this.camera.position.clone().sub(this.controls.target), radius = offset.length();
    const azimuth = Math.atan2(offset.y, offset.x) + across;
    const height = Math.min(Math.max(Math.asin(offset.z / radius) + up, 0.08), 1.55);
    offset.set(Math.cos(height) * Math.cos(azimuth), Math.cos(height) * Math.sin(azimuth), Math.sin(height));
    this.camera.position.copy(this.controls.target).addScaledVector(offset, radius);
    this.controls.update();
  }

  /** Moves the camera on its way to what is wanted, in the direction in which it looks. */
  #approach() {
    const now = performance.now(), step = 1 - Math.exp(-Math.min(now - this.#drawn_ms, most_ms) / settle_ms);
    this.#drawn_ms = now;
    const shown = this.#shown, wanted = this.#wanted, {camera, controls} = this;
    if (shown.isEmpty()) return;
    const left = Math.max(shown.min.distanceTo(wanted.min), shown.max.distanceTo(wanted.max));
    const isThere = left < arrived * wanted.min.distanceTo(wanted.max);
    shown.min.lerp(wanted.min, isThere ? 1 : step);
    shown.max.lerp(wanted.max, isThere ? 1 : step);
    const offset = camera.position.clone().sub(controls.target), away = offset.length();
    if (this.#distance > 0) this.#byHand *= away / this.#distance;
    // So far away that each corner is in view.
    const toEye = offset.divideScalar(away), right = new Vector3().crossVectors(camera.up, toEye).normalize();
    const upwards = new Vector3().crossVectors(toEye, right), centre = shown.getCenter(new Vector3()), corner = new Vector3();
    const tall = Math.tan((0.5 * camera.fov * Math.PI) / 180), wide = camera.aspect * tall;
    let distance = 1;
    for (let i = 0; i < 8; ++i) {
      corner.set(...["x", "y", "z"].map((axis, k) => (i & (1 << k) ? shown.max : shown.min)[axis])).sub(centre);
      const sideways = Math.max(Math.abs(corner.dot(right)) / wide, Math.abs(corner.dot(upwards)) / tall);
      distance = Math.max(distance, margin * sideways + corner.dot(toEye));
    }
    this.#distance = this.#byHand * distance;
    controls.target.copy(centre);
    camera.position.copy(centre).addScaledVector(toEye, this.#distance);
    camera.near = 0.02 * this.#distance;
    camera.far = 20 * this.#distance;
    camera.updateProjectionMatrix();
    camera.lookAt(controls.target);
    this.isSettled = isThere;
    if (!isThere) this.redraw();
  }

  render() {
    if (!this.renderer) return say(this.label, "this browser has no WebGL");
    const {width, height} = sizeOf(this.canvas), pixels = ratio();
    if (width === 0 || height === 0) return;
    if (this.canvas.width !== Math.round(width * pixels) || this.canvas.height !== Math.round(height * pixels)) {
      this.renderer.setSize(Math.round(width * pixels), Math.round(height * pixels), false);
      this.camera.aspect = width / height;
    }
    this.#approach();
    this.renderer.render(this.scene, this.camera);
  }
}
