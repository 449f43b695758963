// Numbers and elements as people read them.

export const deg = (rad) => rad * 180 / Math.PI;
export const rad = (degrees) => degrees * Math.PI / 180;

export function el(name, attributes = {}, ...inside) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) made[key] = value;
    else if (value !== null && value !== undefined && value !== false) made.setAttribute(key, value === true ? "" : value);
  }
  made.append(...inside.filter((each) => each !== null && each !== undefined));
  return made;
}

export function set(node, text) { if (node.textContent !== text) node.textContent = text; }

export function number(value, digits = 2, unit = "") {
  return value === null || value === undefined ? "–" : `${value.toFixed(digits)}${unit ? ` ${unit}` : ""}`;
}

export function age(seconds) {
  if (seconds === null || seconds === undefined) return "never";
  if (seconds < 1) return `${Math.max(0, Math.round(seconds * 1000))} ms`;
  if (seconds < 100) return `${seconds.toFixed(1)} s`;
  return clock(seconds);
}

export function clock(seconds) {
  const whole = Math.max(0, Math.floor(seconds));
  const hours = Math.floor(whole / 3600), minutes = Math.floor(whole / 60) % 60;
  const tail = `${String(minutes).padStart(hours ? 2 : 1, "0")}:${String(whole % 60).padStart(2, "0")}`;
  return hours ? `${hours}:${tail}` : tail;
}

const COLOURS = ["--a", "--b", "--c", "--d", "--e"];
export function colour(index) {
  return getComputedStyle(document.documentElement).getPropertyValue(COLOURS[index % COLOURS.length]).trim();
}
export function shade(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}
