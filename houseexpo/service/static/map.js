// The map of plans: a point each, coloured by a measure; zoom, move, look, open, select.
import { ask, counted, element, rounded, say } from "./api.js";
import { Selection } from "./selection.js";

const board = document.getElementById("board"), { name, query } = board.dataset, canvas = document.getElementById("canvas");
const tip = document.getElementById("tip"), colour = document.getElementById("colour"), selection = new Selection(name);
const TITLES = { rooms: "rooms", source_rooms: "rooms in the source", area: "free area", quality: "quality", doors: "doors" };
const STOPS = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
let map = null, found = null, view = { x: 0, y: 0, size: 1 }, shades = [], box = null, waiting = false;

const shade = (share) => {
  const at = Math.min(Math.max(share, 0), 1) * (STOPS.length - 1), i = Math.min(Math.floor(at), STOPS.length - 2), part = at - i;
  return `rgb(${STOPS[i].map((value, k) => Math.round(value + part * (STOPS[i + 1][k] - value))).join(" ")})`;
};
const scale = () => Math.min(canvas.clientWidth, canvas.clientHeight) / view.size;
const toScreen = (i) => [canvas.clientWidth / 2 + (map.x[i] - 0.5 - view.x) * scale(), canvas.clientHeight / 2 - (map.y[i] - 0.5 - view.y) * scale()];

function colours() {
  const column = map.colours[colour.value] ?? [], known = column.filter((value) => value !== null).sort((a, b) => a - b);
  const low = known[Math.floor(0.02 * known.length)] ?? 0, high = known[Math.ceil(0.98 * known.length) - 1] ?? 1;
  shades = column.map((value) => (value === null ? "#888" : shade((value - low) / Math.max(high - low, 1e-9))));
  const bar = element("i");
  bar.style.background = `linear-gradient(90deg, ${STOPS.map((stop) => `rgb(${stop.join(" ")})`).join(", ")})`;
  document.getElementById("scale").replaceChildren(rounded(low), bar, rounded(high));
  soon();
}

function soon() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => { waiting = false; draw(); });
}

function draw() {
  const dots = devicePixelRatio || 1, [wide, high] = [canvas.clientWidth, canvas.clientHeight];
  if (canvas.width !== Math.round(wide * dots) || canvas.height !== Math.round(high * dots)) { canvas.width = Math.round(wide * dots); canvas.height = Math.round(high * dots); }
  const pen = canvas.getContext("2d");
  pen.setTransform(dots, 0, 0, dots, 0, 0);
  pen.clearRect(0, 0, wide, high);
  if (!map) return;
  const radius = Math.min(Math.max(60 / Math.sqrt(map.x.length), 1.6), 6) / Math.sqrt(Math.max(view.size, 0.15));
  const ink = getComputedStyle(document.body).color;
  for (let i = 0; i < map.x.length; i++) {
    const [x, y] = toScreen(i), chosen = selection.has(map.ids[i]);
    if (x < -9 || y < -9 || x > wide + 9 || y > high + 9) continue;
    pen.globalAlpha = !found || found.has(i) ? 0.9 : 0.12;
    pen.fillStyle = shades[i] ?? "#888";
    pen.beginPath();
    pen.arc(x, y, chosen ? radius + 1.5 : radius, 0, 7);
    pen.fill();
    if (chosen) { pen.lineWidth = 1.5; pen.strokeStyle = ink; pen.stroke(); }
  }
  pen.globalAlpha = 1;
  if (box) { pen.strokeStyle = ink; pen.setLineDash([4, 3]); pen.strokeRect(Math.min(box[0], box[2]), Math.min(box[1], box[3]), Math.abs(box[2] - box[0]), Math.abs(box[3] - box[1])); pen.setLineDash([]); }
}

function nearest(x, y, within = 14) {
  let best = -1, least = within * within;
  for (let i = 0; map && i < map.x.length; i++) {
    if (found && !found.has(i)) continue;
    const [a, b] = toScreen(i), square = (a - x) ** 2 + (b - y) ** 2;
    if (square < least) { least = square; best = i; }
  }
  return best;
}

const address = (i) => `/${name}/plan/${encodeURIComponent(map.ids[i])}${query ? `?${query}` : ""}`;

function look(i) {
  tip.hidden = i < 0;
  canvas.style.cursor = i < 0 ? "" : "pointer";
  if (i < 0) return;
  const [x, y] = toScreen(i);
  tip.replaceChildren(element("img", { src: `/api/${name}/plans/${encodeURIComponent(map.ids[i])}/thumbnail.svg`, alt: "" }), map.titles[i], element("span", {}, map.ids[i]));
  tip.style.left = `${Math.min(Math.max(x + 14, 4), canvas.clientWidth - 176)}px`;
  tip.style.top = `${Math.min(Math.max(y + 14, 4), canvas.clientHeight - 206)}px`;
}

function zoom(factor, x = canvas.clientWidth / 2, y = canvas.clientHeight / 2) {
  const size = Math.min(Math.max(view.size * factor, 0.01), 2), before = scale(), [across, up] = [x - canvas.clientWidth / 2, canvas.clientHeight / 2 - y];
  view = { ...view, size };
  const by = 1 / before - 1 / scale();
  view = { x: view.x + across * by, y: view.y + up * by, size };
  soon();
}

function told() {
  const { size } = selection.ids;
  document.getElementById("chosen").replaceChildren(...(size ? [`${counted(size, "plan")} selected. `, element("a", { href: `/${name}/${query ? `?${query}` : ""}` }, "Tag, compare or download them in the gallery"), " ", element("button", { type: "button", on: { click: () => selection.clear() } }, "Select none")] : []));
  soon();
}

let held = null;
canvas.addEventListener("pointerdown", (event) => {
  held = { x: event.offsetX, y: event.offsetY, view, moved: false, selects: event.shiftKey };
  canvas.setPointerCapture(event.pointerId);
});
canvas.addEventListener("pointermove", (event) => {
  if (!map) return;
  const { offsetX: x, offsetY: y } = event;
  if (!held) { look(nearest(x, y)); return; }
  held.moved ||= Math.hypot(x - held.x, y - held.y) > 4;
  if (!held.moved) return;
  tip.hidden = true;
  if (held.selects) box = [held.x, held.y, x, y];
  else view = { ...view, x: held.view.x - (x - held.x) / scale(), y: held.view.y + (y - held.y) / scale() };
  soon();
});
canvas.addEventListener("pointerup", (event) => {
  const was = held;
  held = null;
  if (!map || !was) return;
  if (box) {
    const [left, right] = [box[0], box[2]].sort((a, b) => a - b), [top, bottom] = [box[1], box[3]].sort((a, b) => a - b);
    const inside = map.ids.filter((_, i) => { const [x, y] = toScreen(i); return x >= left && x <= right && y >= top && y <= bottom && (!found || found.has(i)); });
    box = null;
    selection.put(inside);
  } else if (!was.moved) {
    const i = nearest(event.offsetX, event.offsetY);
    if (i >= 0) location.href = address(i);
  }
  soon();
});
canvas.addEventListener("pointercancel", () => { held = box = null; soon(); });
canvas.addEventListener("pointerleave", () => { if (!held) look(-1); });
canvas.addEventListener("wheel", (event) => { event.preventDefault(); zoom(event.deltaY > 0 ? 1.2 : 1 / 1.2, event.offsetX, event.offsetY); }, { passive: false });
document.getElementById("nearer").addEventListener("click", () => zoom(0.7));
document.getElementById("farther").addEventListener("click", () => zoom(1.4));
document.getElementById("whole").addEventListener("click", () => { view = { x: 0, y: 0, size: 1 }; soon(); });
colour.addEventListener("change", colours);
new ResizeObserver(soon).observe(canvas);
selection.changed(told);

const AGAIN_MS = 3000; // between two questions whether the map is made
const place = () => ask(`/api/${name}/map${query ? `?${query}` : ""}`).then((answer) => {
  const first = !map;
  map = answer;
  found = answer.found && new Set(answer.found);
  if (first) colour.append(...Object.keys(answer.colours).map((each) => element("option", { value: each }, TITLES[each])));
  const said = map.ids.length ? (found ? `${counted(found.size, "plan")} of ${map.ids.length} meet the filter.` : "") : "This data set has no plans.";
  document.getElementById("told").textContent = answer.final ? said : `${said} This is a first sight; the map is being made and will be kept.`.trim();
  canvas.setAttribute("aria-label", `Map of ${counted(map.ids.length, "plan")}`);
  colours();
  told();
  if (!answer.final) setTimeout(place, AGAIN_MS);
}).catch((error) => say(`The map could not be computed: ${error.message}`));
place();
