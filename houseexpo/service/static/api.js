// Asking the service; what fails is said on the page.

export async function ask(path, options) {
  const answer = await fetch(path, options).catch((error) => {
    if (error.name === "AbortError") throw error;
    throw new Error("the server does not answer; is it still running?");
  });
  if (answer.ok) return answer.json();
  let text = `${answer.status}`;
  try { text = (await answer.json()).error; } catch { /* no JSON: the status says it */ }
  throw new Error(text);
}

// Returns a function that asks for one thing at a time: a new question ends the one before, which is answered undefined.
export function latest() {
  let before = null;
  return async (path) => {
    before?.abort();
    const own = before = new AbortController();
    try {
      const found = await ask(path, { signal: own.signal });
      return own.signal.aborted ? undefined : found;
    } catch (error) {
      if (!own.signal.aborted) throw error;
      return undefined;
    }
  };
}

export function say(text) {
  let place = document.getElementById("message");
  if (!place) {
    place = document.createElement("p");
    place.id = "message";
    place.className = "message";
    place.setAttribute("role", "alert");
    document.getElementById("main").prepend(place);
  }
  place.textContent = text;
  place.hidden = !text;
}

export function element(name, attributes = {}, ...children) {
  const svg = SVG.has(name);
  const made = svg ? document.createElementNS("http://www.w3.org/2000/svg", name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key === "on") for (const [event, what] of Object.entries(value)) made.addEventListener(event, what);
    else if (value !== undefined && value !== null && value !== false) made.setAttribute(key, value === true ? "" : value);
  }
  made.append(...children);
  return made;
}

const SVG = new Set(["svg", "g", "path", "rect", "text", "circle", "line", "image", "polyline", "pattern", "clipPath"]);

export const count = (number) => number.toLocaleString("en");
export const counted = (number, word) => `${count(number)} ${word}${number === 1 ? "" : "s"}`;

export function rounded(value, unit = "") {
  const digits = Math.abs(value) >= 100 || Number.isInteger(value) ? 0 : Math.abs(value) >= 10 ? 1 : 2;
  const number = value.toLocaleString("en", { minimumFractionDigits: digits, maximumFractionDigits: digits });
  return `${number}${unit ? ` ${unit}` : ""}`;
}
