// Dark or light: as the system has it until somebody chooses.

const stored = () => { try { return localStorage.getItem("theme"); } catch { return null; } };
const asked = matchMedia("(prefers-color-scheme: light)");
let listeners = [];

function apply() {
  document.documentElement.classList.toggle("light", (stored() ?? (asked.matches ? "light" : "dark")) === "light");
  const style = getComputedStyle(document.documentElement);
  for (const name of ["ground", "card", "line", "grid", "text", "quiet", "accent", "x", "y", "z", "blue", "red", "warn", "bad", "good"]) {
    theme[name] = style.getPropertyValue(`--${name}`).trim();
  }
  theme.isLight = document.documentElement.classList.contains("light");
  for (const each of listeners) each();
}

/** Colours by their names in app.css. */
export const theme = {};
export const onTheme = (listener) => { listeners.push(listener); };

export function toggleTheme() {
  try { localStorage.setItem("theme", theme.isLight ? "dark" : "light"); } catch { /* then for now */ }
  document.documentElement.classList.toggle("light", !theme.isLight);
  apply();
}

asked.addEventListener("change", apply);
apply();

// Magnitudes: dark blue over green to yellow; of even steps to the eye (a polynomial near matplotlib's viridis).
const ramp = [[0.267, 0.005, 0.329], [0.283, 0.141, 0.458], [0.254, 0.265, 0.530], [0.207, 0.372, 0.553],
  [0.164, 0.471, 0.558], [0.128, 0.567, 0.551], [0.135, 0.659, 0.518], [0.267, 0.749, 0.441], [0.478, 0.821, 0.318],
  [0.741, 0.873, 0.150], [0.993, 0.906, 0.144]];

// Of shear over friction: pale to dark red (a path near ColorBrewer's OrRd), in even steps of lightness, which all eyes see.
const slipRamp = [[1, 0.969, 0.925], [0.992, 0.832, 0.620], [0.991, 0.672, 0.460], [0.972, 0.503, 0.328], [0.911, 0.337, 0.237],
  [0.821, 0.159, 0.102], [0.676, 0, 0], [0.498, 0, 0]];

function between(stops, t, out) {
  const at = Math.min(Math.max(t, 0), 1) * (stops.length - 1);
  const i = Math.min(Math.floor(at), stops.length - 2), f = at - i;
  for (let c = 0; c < 3; ++c) out[c] = stops[i][c] * (1 - f) + stops[i + 1][c] * f;
  return out;
}

/** @param t in 0 ... 1 @returns red, green, blue in 0 ... 1 */
export const rampAt = (t, out = [0, 0, 0]) => between(ramp, t, out);
export const slipRampAt = (t) => between(slipRamp, t, [0, 0, 0]);

/** Red, green, blue in 0 ... 1 of a colour in Oklch (Ottosson, 2020), in which equal steps look equal. @param hue [rad] */
function oklch(lightness, chroma, hue) {
  const a = chroma * Math.cos(hue), b = chroma * Math.sin(hue);
  const l = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3, m = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const s = (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3;
  return [4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s, -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
    -0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s].map((one) => {
    const within = Math.min(Math.max(one, 0), 1);
    return within <= 0.0031308 ? 12.92 * within : 1.055 * within ** (1 / 2.4) - 0.055;
  });
}

/** Of a force of size 1: its hue is where it points along the surface; what only presses is grey.
    @param shear its part along the surface @returns red, green, blue in 0 ... 1 */
export function directionAt(x, y, shear) {
  return oklch(theme.isLight ? 0.64 : 0.8, 0.005 + 0.14 * Math.min(1, 1.6 * shear), Math.atan2(y, x));
}

/** A wheel of them, as CSS. */
export const directions = () => `conic-gradient(from 90deg, ${Array.from({length: 13}, (_, i) => {
  const angle = (-2 * Math.PI * i) / 12;  // CSS turns clockwise
  return `rgb(${directionAt(Math.cos(angle), Math.sin(angle), 1).map((one) => Math.round(255 * one)).join(" ")})`;
}).join(", ")})`;
