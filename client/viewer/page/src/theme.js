// Dark or light: as the system has it until somebody chooses.

const stored = () => { try { return localStorage.getItem("theme"); } catch { return null; } };
const asked = matchMedia("(prefers-color-scheme: light)");
let listeners = [];

function apply() {
  document.documentElement.classList.toggle("light", (stored() ?? (asked.matches ? "light" : "dark")) === "light");
  const style = getComputedStyle(document.documentElement);
  for (const name of ["ground", "card", "line", "text", "quiet", "accent", "x", "y", "z", "blue", "red", "warn", "bad", "good"]) {
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
