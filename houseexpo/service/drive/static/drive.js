// Drive: one robot or two in a plan, by keys, by touch, by an explorer of the benchmark, or as it was recorded.
import { Panel } from "./panel.js";

const root = document.getElementById("drive");
const form = document.getElementById("options");
const place = document.getElementById("panels");
const template = document.getElementById("panel");
const two = document.getElementById("two");
const query = new URLSearchParams(location.search);
const fields = new Map([...form.elements].filter((field) => field.name).map((field) => [field.name, field]));
const usual = new Map([...fields].map(([name, field]) => [name, field.value]));
const panels = [];
const down = new Set(); // what is pressed: forward, back, left, right

const KEYS = {
  arrowup: "forward", w: "forward", arrowdown: "back", s: "back", arrowleft: "left", a: "left", arrowright: "right", d: "right",
};

function options() {
  const found = new FormData(form);
  const whole = (name) => Math.trunc(Number(found.get(name)) || 0);
  const [range_m, fov_deg] = found.get("sensor").split(" ").map(Number);
  return {
    range_m, fov_deg, noise: found.get("noise"), people: whole("people"), obstacles: whole("obstacles"),
    speed: found.get("speed"), seed: whole("seed"), pace: Number(found.get("pace")) || 0,
  };
}

function addPanel(driver) {
  const panel = new Panel(template, { address: root.dataset.socket, plan: root.dataset.plan }, driver);
  panels.push(panel);
  panel.element.setAttribute("aria-label", `Robot ${panels.length}`);
  place.append(panel.element);
  let pointed = false; // who chose with the pointer drives next: the keys would choose another driver
  panel.driver.addEventListener("pointerdown", () => { pointed = true; });
  panel.driver.addEventListener("keydown", () => { pointed = false; });
  panel.driver.addEventListener("change", () => { if (pointed) panel.driver.blur(); remember(); panel.begin(options()); });
  for (const button of panel.element.querySelectorAll("[data-move]")) {
    const hold = (event) => { event.preventDefault(); button.setPointerCapture?.(event.pointerId); down.add(button.dataset.move); steer(); };
    const free = () => { down.delete(button.dataset.move); steer(); };
    button.addEventListener("pointerdown", hold);
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) button.addEventListener(name, free);
    button.addEventListener("keydown", (event) => {
      if (event.key === " " || event.key === "Enter") { event.preventDefault(); down.add(button.dataset.move); steer(); }
    });
    button.addEventListener("keyup", (event) => { if (event.key === " " || event.key === "Enter") free(); });
    button.addEventListener("blur", free);
  }
  panel.begin(options());
}

function beginAll() {
  remember();
  for (const panel of panels) panel.begin(options());
}

function steer() {
  const linear = down.has("forward") - down.has("back");
  const angular = down.has("left") - down.has("right");
  const hands = panels.filter((panel) => panel.byHand); // beside a person's robot, explorers are left alone
  for (const panel of hands.length ? hands : panels) panel.move(linear, angular);
}

function lay() {
  place.classList.toggle("two", two.checked);
  if (two.checked && panels.length === 1) addPanel(query.get("other") ?? "frontier");
  while (place.children.length > panels.length) place.lastElementChild.remove();
}

// The address says who drives with which options, so that it can be kept and handed on.
function remember() {
  const said = { plan: root.dataset.plan, driver: panels[0].driver.value };
  if (panels[1]) said.other = panels[1].driver.value;
  for (const [name, field] of fields) if (field.value !== usual.get(name)) said[name] = field.value;
  history.replaceState(null, "", `?${new URLSearchParams(said)}`);
}

function recall() {
  for (const [name, field] of fields) {
    if (!query.has(name)) continue;
    field.value = query.get(name);
    if (!field.value || !field.checkValidity()) field.value = usual.get(name);
  }
}

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.target.matches("input, select, dialog *")) return;
  const key = event.key.toLowerCase();
  if (KEYS[key]) { event.preventDefault(); down.add(KEYS[key]); steer(); }
  else if (event.repeat) return;
  else if (key === "r") for (const panel of panels) panel.again();
  else if (key === "p") for (const panel of panels) panel.hold();
  else if (key === "e") for (const panel of panels) panel.finish();
  else if (key === "f") for (const panel of panels) panel.save();
});
document.addEventListener("keyup", (event) => {
  const move = KEYS[event.key.toLowerCase()];
  if (move) { down.delete(move); steer(); }
});
window.addEventListener("blur", () => { down.clear(); steer(); }); // keys that are let go elsewhere
window.addEventListener("pagehide", () => { for (const panel of panels) panel.end(); });
form.addEventListener("submit", (event) => { event.preventDefault(); document.activeElement?.blur?.(); beginAll(); });
document.getElementById("any-seed").addEventListener("click", () => {
  fields.get("seed").value = Math.floor(Math.random() * 100_000);
  beginAll();
});
two.addEventListener("change", () => {
  if (!two.checked && panels.length === 2) panels.pop().end();
  lay();
  remember();
});
if (matchMedia("(max-width: 900px)").matches) document.getElementById("more").open = false;

recall();
addPanel(query.get("driver") ?? "you");
two.checked = query.has("other");
lay();
