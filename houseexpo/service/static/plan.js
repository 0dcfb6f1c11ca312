// A plan's page: its drawing, what a robot reaches, ways, what is alike.
import { ask, counted, element, latest, say } from "./api.js";
import { Drawing } from "./drawing.js";

const page = document.getElementById("plan"), { name, plan } = page.dataset;
const base = `/api/${name}/plans/${plan}`;
const radius = document.getElementById("radius"), said = document.getElementById("reached"), way = document.getElementById("way");
const box = (layer) => document.querySelector(`[data-layer="${layer}"]`);
let drawing = null, ends = [], clearance = null;
const askReach = latest(), askWay = latest();

const place = document.getElementById("drawing");
ask(`${base}/shape`).then((shape) => {
  drawing = new Drawing(place, shape);
  place.removeAttribute("aria-busy");
  for (const input of document.querySelectorAll("[data-layer]")) {
    drawing.show(input.dataset.layer, input.checked);
    input.addEventListener("change", () => toggled(input.dataset.layer, input.checked));
  }
  drawing.onhover = ([x, y]) => { document.getElementById("where").textContent = `${x.toFixed(2)}, ${y.toFixed(2)} m`; };
  drawing.onclick = (point) => { ends = ends.length === 1 ? [ends[0], point] : [point]; clicked(); };
  legend([]);
  alike();
  if (findRooms) find();
}).catch((error) => say(`The plan could not be drawn: ${error.message}`));

async function toggled(layer, on) {
  drawing.show(layer, on);
  if (!on) return;
  try {
    if (layer === "clearance" && !clearance) {
      clearance = await ask(`${base}/clearance`);
      drawing.clearance(clearance);
      way.textContent = `Blue: at a wall. Yellow: ${clearance.most} m from the nearest wall.`;
    }
    if (layer === "reach") await reach();
  } catch (error) { say(error.message); }
}

async function reach() {
  const found = await askReach(`${base}/reach?radius=${Number(radius.value).toFixed(2)}`);
  if (!found) return false;
  drawing.reach(found);
  const share = `${(100 * found.largest_share).toFixed(1)}%`;
  said.textContent = found.components === 0 ? "The robot fits nowhere."
    : found.components === 1 ? `The robot reaches every place where it fits. Narrowest passage: ${found.narrowest} m.`
      : `${found.components} pieces; the biggest (green) is ${share}. Narrowest passage inside it ${found.narrowest} m.`;
  return true;
}

let sliding = 0;
radius.addEventListener("input", () => {
  document.getElementById("radius-said").textContent = `${Number(radius.value).toFixed(2)} m`;
  clearTimeout(sliding);
  sliding = setTimeout(() => {
    if (!drawing) return;
    box("reach").checked = true;
    drawing.show("reach", true);
    reach().then((shown) => shown && ends.length === 2 && clicked()).catch((error) => say(error.message));
  }, 60);
});

async function clicked() {
  drawing.way(ends, null);
  const words = ends.map(([x, y]) => `${x.toFixed(2)}, ${y.toFixed(2)}`);
  document.getElementById("from").value = words[0];
  document.getElementById("to").value = words[1] ?? "";
  if (ends.length < 2) { way.textContent = "Click the end of the path."; return; }
  const query = new URLSearchParams({ from: ends[0].join(","), to: ends[1].join(","), radius: Number(radius.value).toFixed(2) });
  try {
    const found = await askWay(`${base}/way?${query}`);
    if (!found) return;
    drawing.way(found.ends ?? ends, found.points);
    way.textContent = found.found ? `${found.length.toFixed(2)} m for a robot of ${Number(radius.value).toFixed(2)} m radius.` : found.why;
  } catch (error) { way.textContent = error.message; }
}

document.getElementById("way-form").addEventListener("submit", (event) => {
  event.preventDefault();
  const points = ["from", "to"].map((id) => document.getElementById(id).value.split(/[\s,;]+/).filter(Boolean).map(Number));
  if (points.some((point) => point.length !== 2 || point.some(Number.isNaN))) { way.textContent = "Enter each point as x, y in metres."; return; }
  ends = points;
  if (drawing) clicked();
});

document.getElementById("nearer").addEventListener("click", () => drawing?.zoom(0.8));
document.getElementById("farther").addEventListener("click", () => drawing?.zoom(1.25));
document.getElementById("whole").addEventListener("click", () => drawing?.look(drawing.home));
// A plan that records an outline and label boxes only is shown with the rooms that our library finds; one click shows the record.
const findRooms = document.getElementById("find-rooms");
async function find() {
  const told = document.getElementById("finding");
  try {
    const found = await ask(`${base}/rooms`);
    drawing.rooms(found);
    shown(true);
    legend([...found.rooms.map((each) => [each.label, each.colour]), ...found.doors.map((each) => [each.kind, each.colour])]);
    told.textContent = `This plan has only an outline and label boxes. Found: ${counted(found.rooms.length, "room")}, ${counted(found.doors.length, "door")}.`;
    findRooms.hidden = false;
  } catch (error) { told.textContent = `This plan has only an outline and label boxes; its rooms could not be found: ${error.message}`; }
}

function shown(found) {
  for (const [layer, on] of [["boxes", !found], ["rooms", found], ["doors", found]]) { box(layer).checked = on; drawing.show(layer, on); }
  findRooms.setAttribute("aria-pressed", String(found));
}

findRooms?.addEventListener("click", () => shown(findRooms.getAttribute("aria-pressed") !== "true"));

function legend(found) {
  const place = document.getElementById("legend"), colours = new Map(found);
  if (found.length) place.replaceChildren(...[...colours].map(([words, colour]) => element("li", {}, element("i", { class: "colour", "data-colour": colour }), words)));
  for (const each of place.querySelectorAll(".colour")) each.style.background = each.dataset.colour;
}

async function alike() {
  const section = document.getElementById("alike"), status = section.querySelector("[role=status]");
  try {
    const { similar } = await ask(`${base}/similar`);
    section.querySelector(".strip").append(...similar.map((each) => element("li", {}, element("a", { href: `/${name}/plan/${encodeURIComponent(each.id)}` },
      element("img", { src: `/api/${name}/plans/${encodeURIComponent(each.id)}/thumbnail.svg`, alt: "", width: 124, height: 124, loading: "lazy" }),
      element("span", { class: "name" }, each.title), element("span", {}, `${(100 * each.difference).toFixed(1)}% differs`)))));
    status.textContent = similar.length ? "" : "No similar plans.";
  } catch (error) { status.textContent = error.message; }
}

for (const [button, what, told] of [["copy", "python", "copied"], ["copy-id", "id", "id-copied"]]) {
  document.getElementById(button).addEventListener("click", async () => {
    const text = document.getElementById(what), said = document.getElementById(told);
    try { await navigator.clipboard.writeText(text.textContent); said.textContent = "Copied."; }
    catch { getSelection().selectAllChildren(text); said.textContent = "Selected; copy with the keyboard."; }
  });
}

addEventListener("keydown", (event) => {
  if (event.target.matches("input, select, textarea") || event.ctrlKey || event.metaKey || event.altKey) return;
  const id = { p: "before", n: "after" }[event.key];
  if (id) document.getElementById(id)?.click();
});
