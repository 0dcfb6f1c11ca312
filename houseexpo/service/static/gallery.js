// The gallery: what is asked for stands in the address, and the page shows what the address says.
import { ask, count, element, say } from "./api.js";
import { Brush } from "./brush.js";
import { Grid, plansFound } from "./grid.js";

const place = document.getElementById("gallery"), name = place.dataset.name;
const grid = new Grid(document.getElementById("plans"), name);
const sort = document.getElementById("sort"), descending = document.getElementById("descending");
const text = document.getElementById("text"), radiusOf = new Set(["reach", "narrowest"]);
const brushes = new Map();
let state = new URLSearchParams(location.search), whole = null, about = null, asked = 0;

const list = (key) => (state.get(key) || "").split(",").filter(Boolean);
const put = (key, value) => (value ? state.set(key, value) : state.delete(key));
const span = ([low, high]) => (low === null && high === null ? "" : low === high ? `${low}` : `${low ?? ""}..${high ?? ""}`);

function range(key) {
  const value = state.get(key);
  if (!value) return null;
  const [low, high] = value.includes("..") ? value.split("..") : [value, value];
  return [low === "" ? null : Number(low), high === "" ? null : Number(high)];
}

function go(push = true) {
  const query = state.toString().replaceAll("%2C", ",");
  history[push ? "pushState" : "replaceState"](null, "", query ? `?${query}` : location.pathname);
  show();
}

async function show() {
  const turn = ++asked, query = state.toString();
  try {
    const facets = await ask(`/api/${name}/facets?${query}`);
    const radius = state.get("radius") ?? "0.20";
    const total = whole?.get(radius) ?? (query === "" ? facets : await ask(`/api/${name}/facets?radius=${radius}`));
    (whole ??= new Map()).set(radius, total);
    if (turn !== asked) return;
    say("");
    draw(facets, total, radius);
    grid.show(query, facets.found);
  } catch (error) {
    if (turn !== asked) return;
    say(`This view cannot be shown: ${error.message}`);
    document.getElementById("clear").hidden = false;
  }
}

function draw(facets, total, radius) {
  document.getElementById("count").textContent = plansFound(facets.found, facets.total);
  document.getElementById("nothing").hidden = facets.found > 0;
  for (const [key, brush] of brushes) brush.show(facets.measures[key], total.measures[key], range(key), radius);
  drawLabels(facets.labels, total.labels);
  for (const key of ["source", "split"]) drawTicks(key, facets[key]);
  const filters = [...state.keys()].filter((key) => !["sort", "radius"].includes(key)).length;
  document.getElementById("active").textContent = filters ? `(${filters})` : "";
  document.getElementById("clear").hidden = !filters;
  const by = state.get("sort") ?? "id";
  sort.value = by.replace("-", "");
  for (const each of sort.options) each.hidden = !each.selected && each.value !== "id" && !total.measures[each.value].counts.some(Boolean);
  descending.setAttribute("aria-pressed", by.startsWith("-"));
  if (document.activeElement !== text) text.value = state.get("text") ?? "";
  const query = state.toString();
  document.getElementById("as-statistics").href = `/${name}/statistics${query ? `?${query}` : ""}`;
  document.getElementById("as-ids").href = `/api/${name}/ids.txt${query ? `?${query}` : ""}`;
}

function drawLabels(counts, total) {
  const box = document.querySelector("#labels .chips"), focused = document.activeElement?.dataset?.label;
  const chips = Object.keys(counts).filter((label) => total[label]).sort((a, b) => total[b] - total[a]).map((label) => {
    const chosen = list("labels").includes(label) ? "with" : list("without").includes(label) ? "without" : "";
    const words = { with: "has to occur", without: "must not occur", "": "any" }[chosen];
    return element("button", {
      type: "button", "data-label": label, "data-state": chosen, "aria-pressed": String(chosen === "with"),
      title: `${label.replaceAll("_", " ")}: ${words}`, on: { click: () => turn(label, chosen) },
    }, label.replaceAll("_", " "), " ", element("small", {}, count(counts[label])));
  });
  box.replaceChildren(...chips);
  if (focused) box.querySelector(`[data-label="${focused}"]`)?.focus();
}

function turn(label, chosen) { // any, then with it, then without it
  const without = (key) => list(key).filter((each) => each !== label);
  put("labels", [...without("labels"), ...(chosen === "" ? [label] : [])].join(","));
  put("without", [...without("without"), ...(chosen === "with" ? [label] : [])].join(","));
  go();
}

function drawTicks(key, counts) {
  const box = document.getElementById(key), names = Object.keys(counts), focused = document.activeElement?.value;
  box.hidden = names.length === 0;
  box.querySelector(".ticks").replaceChildren(...names.map((each) => element("label", {},
    element("input", { type: "checkbox", value: each, checked: list(key).includes(each), on: { change: (event) => {
      put(key, [...list(key).filter((one) => one !== each), ...(event.target.checked ? [each] : [])].join(","));
      go();
    } } }), each, element("small", {}, count(counts[each])))));
  if (focused && names.includes(focused)) box.querySelector(`[value="${CSS.escape(focused)}"]`)?.focus();
}

async function start() {
  about = await ask(`/api/${name}`);
  sort.append(element("option", { value: "id" }, "id"), ...about.measures.map((each) => element("option", { value: each.name }, each.title)));
  for (const measure of about.measures) {
    const brush = new Brush(measure, radiusOf.has(measure.name) ? about.radii : null, (key, chosen, radius) => {
      put(key, span(chosen));
      if (radius) put("radius", radius === "0.20" ? "" : radius);
      go();
    });
    brushes.set(measure.name, brush);
    document.getElementById("measures").append(brush.node);
  }
  await show();
}

let typing = 0, typed = false; // a word is one step back, not each of its letters
text.addEventListener("input", () => {
  clearTimeout(typing);
  typing = setTimeout(() => { put("text", text.value.trim()); go(!typed); typed = true; }, 200);
});
text.addEventListener("change", () => { typed = false; });
document.getElementById("form").addEventListener("submit", (event) => event.preventDefault());
const sorted = (key, down) => { put("sort", key === "id" && !down ? "" : (down ? "-" : "") + key); go(); };
sort.addEventListener("change", () => sorted(sort.value, descending.getAttribute("aria-pressed") === "true"));
descending.addEventListener("click", () => sorted(sort.value, descending.getAttribute("aria-pressed") !== "true"));
document.getElementById("clear").addEventListener("click", () => {
  const refused = document.getElementById("message")?.hidden === false; // the sort may be what is wrong
  state = new URLSearchParams([...state].filter(([key]) => !refused && ["sort", "radius"].includes(key)));
  go();
});
document.querySelector('.skip[href="#plans"]').addEventListener("click", (event) => { event.preventDefault(); grid.focus(); });
addEventListener("popstate", () => { state = new URLSearchParams(location.search); show(); });
if (matchMedia("(max-width: 820px)").matches) document.getElementById("filters").open = false;

// Who comes back from a plan finds the place that it was chosen at.
const left = `left ${location.pathname}${location.search}`, [{ type }] = performance.getEntriesByType("navigation");
addEventListener("pagehide", () => sessionStorage.setItem(`left ${location.pathname}${location.search}`, scrollY));
start().then(() => { if (["back_forward", "reload"].includes(type)) scrollTo(0, sessionStorage.getItem(left) ?? 0); })
  .catch((error) => say(error.message));
