// What the views in three dimensions share: a renderer that draws when something is new, a camera that is turned by hand.
// Millimetres; the gel frame's z, into the gel, points down on the screen.
import {AmbientLight, ColorManagement, DirectionalLight, Group, LinearSRGBColorSpace, PerspectiveCamera, Scene, WebGLRenderer} from "three";
import {OrbitControls} from "three/addons/controls/OrbitControls.js";

import {isSlow, ratio, say, sizeOf} from "./canvas.js";
import {onTheme, theme} from "./theme.js";

ColorManagement.enabled = false;  // colours are the screen's from the start, and no pixel is converted

/** Where the light comes from, in the scene: x to the right, y away, z up. */
export const sunlight = [-0.52, 0.347, 0.78];

export class Stage {
  /** @param redraw is called when the camera or the colours have changed */
  constructor(canvas, label, redraw) {
    this.canvas = canvas;
    this.label = label;
    try {
      this.renderer = new WebGLRenderer({canvas, antialias: !isSlow, powerPreference: "low-power"});
      this.renderer.outputColorSpace = LinearSRGBColorSpace;
    } catch {
      this.renderer = null;  // the page's other half is seen all the same
    }
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(32, 1, 1, 2000);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.maxPolarAngle = 1.5;
    this.controls.addEventListener("change", redraw);
    this.gel = new Group();  // in the gel frame; x to the right, y up in the picture, z away from who presses
    this.gel.scale.z = -1;
    this.scene.add(this.gel);
    const sun = new DirectionalLight(0xffffff, 1.7);
    sun.position.fromArray(sunlight);
    this.scene.add(new AmbientLight(0xffffff, 1.7), sun);
    const clear = () => this.renderer?.setClearColor(theme.card);
    onTheme(() => { clear(); redraw(); });
    clear();
  }

  /** Looks at what is so wide [mm] and high. */
  frame(width, height) {
    if (this.framed === `${width} ${height}`) return;
    this.framed = `${width} ${height}`;
    this.size = Math.hypot(width, height);
    this.reset();
  }

  reset() {
    const distance = 1.36 * (this.size ?? 80);
    this.camera.position.set(0.12 * distance, -0.72 * distance, 0.62 * distance);
    this.controls.target.set(0, 0, 0);
    this.controls.update();
  }

  /** By the keyboard [rad]. */
  turn(across, up) {
    const {position} = this.camera;
    const radius = position.length();
    const azimuth = Math.atan2(position.y, position.x) + across;
    const height = Math.min(Math.max(Math.asin(position.z / radius) + up, 0.08), 1.55);
    position.set(radius * Math.cos(height) * Math.cos(azimuth), radius * Math.cos(height) * Math.sin(azimuth),
                 radius * Math.sin(height));
    this.controls.update();
  }

  render() {
    if (!this.renderer) return say(this.label, "this browser has no WebGL");
    const {width, height} = sizeOf(this.canvas), pixels = ratio();
    if (width === 0 || height === 0) return;
    if (this.canvas.width !== Math.floor(width * pixels) || this.canvas.height !== Math.floor(height * pixels)) {
      this.renderer.setPixelRatio(pixels);
      this.renderer.setSize(width, height, false);
      this.camera.aspect = width / height;
      this.camera.fov = width < height ? 44 : 32;
      this.camera.updateProjectionMatrix();
    }
    this.renderer.render(this.scene, this.camera);
  }
}
