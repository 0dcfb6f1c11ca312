// The gallery: what is asked for stands in the address, and the page shows what the address says.
import { ask, count, counted, element, rounded, say } from "./api.js";
import { Brush } from "./brush.js";
import { Grid, plansFound } from "./grid.js";
import { Selection, SelectionBar } from "./selection.js";

const place = document.getElementById("gallery"), { name } = place.dataset;
const selection = new Selection(name), grid = new Grid(document.getElementById("plans"), document.getElementById("head"), name, selection);
const PAGE = ["view", "columns"], USUAL = ["rooms", "source_rooms", "area", "doors", "quality", "source", "labels"]; // the page's own: they say how, not which
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

// What the API is asked for: the view without how it is shown.
function asking() {
  const query = new URLSearchParams(state);
  for (const key of PAGE) query.delete(key);
  return query.toString();
}

function go(push = true) {
  const query = state.toString().replaceAll("%2C", ",");
  history[push ? "pushState" : "replaceState"](null, "", query ? `?${query}` : location.pathname);
  show();
}

async function show() {
  const turn = ++asked, query = asking();
  try {
    const facets = await ask(`/api/${name}/facets?${query}`);
    const radius = state.get("radius") ?? "0.20";
    const total = whole?.get(radius) ?? (query === "" ? facets : await ask(`/api/${name}/facets?radius=${radius}`));
    (whole ??= new Map()).set(radius, total);
    if (turn !== asked) return;
    say("");
    draw(facets, total, radius);
    grid.show(query, facets.found, columns(total));
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
  const active = conditions();
  drawActive(active, facets);
  document.getElementById("active").textContent = active.length ? `(${active.length})` : "";
  document.getElementById("clear").hidden = !active.length;
  const by = state.get("sort") ?? "id";
  sort.value = by.replace("-", "");
  for (const each of sort.options) each.hidden = !each.selected && each.value !== "id" && !total.measures[each.value].counts.some(Boolean);
  descending.setAttribute("aria-pressed", by.startsWith("-"));
  if (document.activeElement !== text) text.value = state.get("text") ?? "";
  const query = asking();
  document.getElementById("as-statistics").href = `/${name}/statistics${query ? `?${query}` : ""}`;
  document.getElementById("as-ids").href = `/api/${name}/ids.txt${query ? `?${query}` : ""}`;
}

// The conditions of the view, one each: its name in the answers' "without", its words, and how it is taken off.
function conditions() {
  const without = (key, value) => () => put(key, list(key).filter((each) => each !== value).join(","));
  const spelt = (label) => label.replaceAll("_", " ");
  const ends = ({ unit }, [low, high]) => (low === high ? rounded(low, unit) : low === null ? `at most ${rounded(high, unit)}`
    : high === null ? `at least ${rounded(low, unit)}` : `${rounded(low)} to ${rounded(high, unit)}`);
  return [
    ...about.measures.filter(({ name: key }) => range(key)).map((measure) => ({ key: measure.name, words: `${measure.title}: ${ends(measure, range(measure.name))}`, off: () => put(measure.name, "") })),
    ...list("labels").map((label) => ({ key: `labels=${label}`, words: `with ${spelt(label)}`, off: without("labels", label) })),
    ...list("without").map((label) => ({ key: `without=${label}`, words: `without ${spelt(label)}`, off: without("without", label) })),
    ...["source", "split"].filter((key) => list(key).length).map((key) => ({ key, words: `${key}: ${list(key).join(" or ")}`, off: () => put(key, "") })),
    ...(state.get("text") ? [{ key: "text", words: `“${state.get("text")}”`, off: () => put("text", "") }] : []),
  ];
}

const foundWithout = (facets, key) => facets.without[Object.keys(facets.without).find((each) => each.toLowerCase() === key.toLowerCase())];

function drawActive(active, facets) {
  const chip = ({ words, off }) => element("button", { type: "button", class: "off", title: "Remove this condition", on: { click: () => { off(); go(); } } },
    words, " ", element("span", { "aria-hidden": "true" }, "×"), element("span", { class: "unseen" }, ", remove"));
  document.getElementById("conditions").replaceChildren(...active.map(chip));
  const nothing = document.getElementById("nothing"), most = active.map((each) => ({ ...each, found: foundWithout(facets, each.key) })).filter((each) => each.found).sort((a, b) => b.found - a.found);
  if (facets.found > 0) return;
  nothing.replaceChildren(element("p", {}, facets.total === 0 ? "This data set has no plans."
    : most.length ? "No plan meets all conditions. Remove one:" : "No plan meets these conditions, even if one is removed. Clear the filters."),
  element("ul", {}, ...most.map((each) => element("li", {}, element("button", { type: "button", on: { click: () => { each.off(); go(); } } }, `${each.words} ×`), ` leaves ${counted(each.found, "plan")}`))));
}

function columns(total) { // null: tiles
  const table = state.get("view") === "table", picked = () => (list("columns").length ? list("columns") : USUAL), chosen = picked(), by = state.get("sort") ?? "id";
  document.getElementById("as-table").setAttribute("aria-pressed", String(table));
  document.getElementById("as-tiles").setAttribute("aria-pressed", String(!table));
  document.getElementById("choose").hidden = !table;
  document.getElementById("head").hidden = !table;
  const frame = document.getElementById("table");
  if (table) { frame.setAttribute("role", "table"); frame.setAttribute("aria-label", "Plans found"); }
  else for (const each of ["role", "aria-label"]) frame.removeAttribute(each);
  if (!table) return null;
  const known = [...about.measures.filter((each) => total.measures[each.name].counts.some(Boolean)),
    ...["source", "split"].filter((key) => Object.keys(total[key]).length).map((key) => ({ name: key, title: key[0].toUpperCase() + key.slice(1) })),
    { name: "labels", title: "Labels" }];
  const shown = known.filter((each) => chosen.includes(each.name));
  document.getElementById("column-names").replaceChildren(...known.map((each) => element("label", {},
    element("input", { type: "checkbox", checked: chosen.includes(each.name), on: { change: (event) => {
      const before = picked(); // not those of the drawing: a second choice may come before the page is drawn again
      const now = known.map((one) => one.name).filter((one) => (one === each.name ? event.target.checked : before.includes(one)));
      put("columns", now.join(","));
      go(false);
    } } }), each.title)));
  const sorting = (each) => (by.replace("-", "") !== each ? "none" : by.startsWith("-") ? "descending" : "ascending");
  const mark = { none: "", ascending: " ↑", descending: " ↓" };
  const cell = (each, words) => element("span", { class: "cell", role: "columnheader", "aria-sort": sorting(each) },
    [...sort.options].some((option) => option.value === each)
      ? element("button", { type: "button", class: "quiet", "data-column": each, on: { click: () => sorted(each, (state.get("sort") ?? "id") === each) } }, words + mark[sorting(each)]) : words);
  const head = document.getElementById("head"), focused = document.activeElement?.dataset?.column;
  head.replaceChildren(cell("id", "Plan"), ...shown.map((each) => cell(each.name, each.title + (each.unit ? `, ${each.unit}` : ""))));
  if (focused) head.querySelector(`[data-column="${focused}"]`)?.focus();
  const wide = { labels: "minmax(180px, 2fr)" };
  frame.style.setProperty("--columns", `minmax(230px, 1.4fr) ${shown.map((each) => wide[each.name] ?? "minmax(88px, 1fr)").join(" ")}`);
  return shown.map((each) => ({ ...each, unit: "" }));
}

function drawLabels(counts, total) {
  const box = document.querySelector("#labels .chips"), focused = document.activeElement?.dataset?.label;
  const chips = Object.keys(counts).filter((label) => total[label]).sort((a, b) => total[b] - total[a]).map((label) => {
    const chosen = list("labels").includes(label) ? "with" : list("without").includes(label) ? "without" : "";
    const words = { with: "required", without: "excluded", "": "any" }[chosen];
    return element("button", {
      type: "button", "data-label": label, "data-state": chosen, "aria-pressed": String(chosen === "with"),
      title: `${label.replaceAll("_", " ")}: ${words}`, on: { click: () => turn(label, chosen) },
    }, element("i", { class: "colour", "data-colour": about.colours[label] }), label.replaceAll("_", " "), " ", element("small", {}, count(counts[label])));
  });
  box.replaceChildren(...chips);
  for (const each of box.querySelectorAll(".colour")) each.style.background = each.dataset.colour;
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
  for (const [kind, colour] of Object.entries(about.door_colours)) {
    const mark = element("i", { class: "colour" });
    mark.style.background = colour;
    document.getElementById("door-colours").append(element("span", {}, mark, kind));
  }
  new SelectionBar(document.getElementById("selection"), selection, about, asking);
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
for (const [id, view] of [["as-tiles", ""], ["as-table", "table"]]) document.getElementById(id).addEventListener("click", () => { put("view", view); go(false); });
document.getElementById("clear").addEventListener("click", () => {
  const refused = document.getElementById("message")?.hidden === false; // the sort may be what is wrong
  state = new URLSearchParams([...state].filter(([key]) => !refused && ["sort", "radius", ...PAGE].includes(key)));
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
