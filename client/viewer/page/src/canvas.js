// What the views share: how large a canvas is, how many pixels it gets, its label.
import {theme} from "./theme.js";

/** Whether the processor draws what others leave to a graphics card: edges are left as they are then, and pixels few. */
export const isSlow = (() => {
  const context = document.createElement("canvas").getContext("webgl2");
  const info = context?.getExtension("WEBGL_debug_renderer_info");
  const name = info ? context.getParameter(info.UNMASKED_RENDERER_WEBGL) : "";
  context?.getExtension("WEBGL_lose_context")?.loseContext();
  return context === null || /swiftshader|llvmpipe|software/i.test(name);
})();

export const ratio = () => Math.min(devicePixelRatio, isSlow ? 1 : 2);

// To ask a canvas for its size has the browser lay out the page. It is that of the pixels that it covers: one more or less, and the
// browser scales it, for each picture.
const sizes = new WeakMap();
const observer = new ResizeObserver((entries) => {
  for (const {target, devicePixelContentBoxSize: pixels, contentRect} of entries) {
    const [width, height] = pixels ? [pixels[0].inlineSize / devicePixelRatio, pixels[0].blockSize / devicePixelRatio] :
      [Math.round(contentRect.width), Math.round(contentRect.height)];
    sizes.set(target, {width, height});
  }
});

/** Of the canvas on the page [CSS px]. */
export function sizeOf(canvas) {
  if (!sizes.has(canvas)) {
    sizes.set(canvas, {width: canvas.clientWidth, height: canvas.clientHeight});
    try {
      observer.observe(canvas, {box: "device-pixel-content-box"});
    } catch {  // not every browser has it
      observer.observe(canvas);
    }
  }
  return sizes.get(canvas);
}

/** A 2D canvas of as many pixels as the screen has there, to be covered by a Ground; null: it is not seen. */
export function fit(canvas) {
  const {width, height} = sizeOf(canvas), pixels = ratio();
  if (width === 0 || height === 0) return null;
  if (canvas.width !== Math.round(pixels * width) || canvas.height !== Math.round(pixels * height)) {
    canvas.width = Math.round(pixels * width);
    canvas.height = Math.round(pixels * height);
  }
  const context = canvas.getContext("2d", {alpha: false});  // what covers all below it is put there as it is
  context.setTransform(pixels, 0, 0, pixels, 0, 0);
  return {context, width, height};
}

/** Leaves the card, where there is nothing to draw. @param fitted of fit() */
export function blank({context, width, height}) {
  context.fillStyle = theme.card;
  context.fillRect(0, 0, width, height);
}

/** What lies below all else in a canvas and seldom changes: drawn once, and put there as it is. */
export class Ground {
  #canvas = document.createElement("canvas");
  #key = "";

  /** @param fitted of fit() @param of numbers and words that it depends on, beside size and colours @param paint draws it on the card */
  put({context, width, height}, of, paint) {
    const pixels = ratio(), key = [width, height, pixels, theme.isLight, ...of].join(" ");
    if (key !== this.#key) {
      this.#key = key;
      Object.assign(this.#canvas, {width: context.canvas.width, height: context.canvas.height});
      const own = this.#canvas.getContext("2d", {alpha: false});
      own.setTransform(pixels, 0, 0, pixels, 0, 0);
      own.fillStyle = theme.card;
      own.fillRect(0, 0, width, height);
      paint(own);
    }
    context.drawImage(this.#canvas, 0, 0, width, height);
  }
}

/**
 * Makes a function of where points of the gel frame [m] lie on the screen [CSS px], by the context's transform as it is now.
 * @param place of a point in the context's units
 */
export function screenPlaces(context, place) {
  const before = context.getTransform(), pixels = ratio();
  const onScreen = (point) => {
    const {x: u, y: v} = before.transformPoint(new DOMPoint(...place(point)));
    return [u / pixels, v / pixels];
  };
  return Object.assign(onScreen, {pixels});
}

/** A text that is there already costs nothing. */
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}
