// What is said of a whole file: its axis, its size, its floors, what of it is left out.
const BY_NAME = new Set(["drop_nodes", "wall_layers"]); // what is said of parts of the file, by their names
const at = (id) => document.getElementById(id);
const LOWEST_STOREY_M = 1.8; // of two floors that are nearer to one another, one is none (`corrections.vocabulary`)
const TITLES = {
  distance: ["A known distance", "Metres; then draw the distance from end to end"],
  units: ["The unit", "m, cm, mm, in, ft, or the metres of a unit"],
  scale: ["The scale", "N of 1:N, such as 20 for a model at 1:20; it is no factor on what is shown"],
  storey_height: ["The height of a storey", "Metres from floor to floor"],
  up: ["The upward axis", "y or z"],
  floors: ["The floors", "Heights of the floors, metres; type them, or click them in the picture"],
  drop_nodes: ["Parts to leave out", ""],
  wall_layers: ["Layers of walls", ""],
  keep: ["It is a house", "yes: read it although it looks like none"],
};

export class FileForm {
  // `hooks`: draw(done) draws a distance, say(key, value, points) says it, parts(names, picks) shows parts of the file in the plan.
  constructor(hooks) {
    this.hooks = hooks;
    this.side = null;
    at("file-key").addEventListener("change", () => this.begin());
    for (const id of ["side", "file-side"]) at(id).addEventListener("click", (event) => this.pickFloor(event));
    at("file-names").addEventListener("change", () => this.choose());
    at("file-form").addEventListener("submit", (event) => { event.preventDefault(); this.submit(); });
  }

  show({ known, why, file, said, takes, names, floors = [], unit_m: unit }, readOnly) {
    this.floors = said.floors ?? floors;
    this.size = unit ? `. One unit of the file is ${Number(unit.toPrecision(4))} m now` : "";
    at("file-words").textContent = why || (!known ? "The source is being read." : `Of ${file}. The source is read again with it.`);
    at("file-form").hidden = readOnly || !takes.length;
    const key = at("file-key").value;
    const keys = Object.keys(TITLES).filter((each) => takes.includes(each));
    at("file-key").replaceChildren(...keys.map((each) => new Option(TITLES[each][0], each, false, each === key)));
    Object.assign(this, { all: names, said });
    this.list();
    at("file-said").replaceChildren(...Object.entries(said).map(([each, value]) => this.line(each, value, readOnly)));
    this.choose();
  }

  line(key, value, readOnly) {
    const line = document.createElement("li");
    const out = Object.assign(document.createElement("button"), { type: "button", textContent: "×", className: "out", disabled: readOnly });
    out.setAttribute("aria-label", `Take out: ${key.replaceAll("_", " ")} of the file`);
    out.addEventListener("click", () => this.hooks.say(key, ""));
    line.append(Object.assign(document.createElement("span"), { textContent: `${key} = ${JSON.stringify(value)}` }), out);
    return line;
  }

  // Begins a statement; of the floors, with those that are known.
  begin() {
    this.list();
    at("file-value").value = at("file-key").value === "floors" ? this.floors.join(", ") : "";
    this.choose();
  }

  // Takes the picture of the file from the side, null if there is none.
  lookFrom(side) {
    this.side = side ?? null;
    if (side) for (const id of ["side", "file-side"]) at(id).src = `data:image/png;base64,${side.png}`;
    this.choose();
  }

  // The height of a click in the picture from the side is one of the floors.
  pickFloor({ target, clientY }) {
    if (at("file-form").hidden) return;
    const { bounds: [, low, , high] } = this.side, { top, height } = target.getBoundingClientRect();
    const picked = Number((high - ((clientY - top) / height) * (high - low)).toFixed(2));
    if (at("file-key").value !== "floors") this.open("floors");
    const others = at("file-value").value.split(/[,;\s]+/).filter(Boolean).map(Number).filter((each) => Math.abs(each - picked) >= LOWEST_STOREY_M);
    at("file-value").value = [...others, picked].sort((a, b) => a - b).join(", ");
    at("file-value").focus();
  }

  // The names of the parts; those of which the chosen key is said are marked.
  list() {
    const said = this.said?.[at("file-key").value] ?? [];
    at("file-names").replaceChildren(...(this.all ?? []).map((name) => new Option(name, name, false, [said].flat().includes(name))));
  }

  choose() {
    const key = at("file-key").value, nodes = BY_NAME.has(key);
    at("file-line").hidden = nodes;
    at("file-nodes").hidden = !nodes;
    at("file-side").hidden = key !== "floors" || !this.side;
    this.hooks.parts(nodes ? this.names : [], nodes);
    at("file-title").textContent = (TITLES[key]?.[1] ?? "") + (["scale", "units"].includes(key) ? this.size : "");
  }

  get names() { return [...at("file-names").selectedOptions].map((each) => each.value); }

  // Chooses a part, or no longer.
  toggle(name) {
    const found = [...at("file-names").options].find((each) => each.value === name);
    if (!found) return;
    found.selected = !found.selected;
    found.scrollIntoView({ block: "nearest" });
    this.choose();
  }

  // Goes to the form, and to one of its statements where a key is given.
  open(key = "") {
    at("file-form").scrollIntoView({ block: "center" });
    if (key) at("file-key").value = key;
    if (key) this.begin();
    at(key ? "file-value" : "file-key").focus();
  }

  submit() {
    const key = at("file-key").value;
    const value = BY_NAME.has(key) ? this.names.join("\n") : at("file-value").value.trim();
    if (!value) { at("file-value").focus(); return; }
    at("file-value").value = "";
    at("stage").focus({ preventScroll: true }); // keys are answers again
    if (key === "distance") this.hooks.draw((points) => this.hooks.say(key, value, points));
    else this.hooks.say(key, value);
  }
}
