// What is said of a whole file: its axis, its size, its floors, what of it is left out.
const at = (id) => document.getElementById(id);
const TITLES = {
  distance: ["A known distance", "Metres; then draw the distance from end to end"],
  units: ["The unit", "m, cm, mm, in, ft, or the metres of a unit"],
  scale: ["The scale", "N of 1:N, such as 20 for a model at 1:20; it is no factor on what is shown"],
  storey_height: ["The height of a storey", "Metres from floor to floor"],
  up: ["The upward axis", "y or z"],
  floors: ["The floors", "Heights of the floors, metres, such as 0, 2.8"],
  drop_nodes: ["Parts to leave out", ""],
  keep: ["It is a house", "yes: read it although it looks like none"],
};

export class FileForm {
  // `hooks`: draw(done) draws a distance, say(key, value, points) says it, parts(names, picks) shows parts of the file in the plan.
  constructor(hooks) {
    this.hooks = hooks;
    at("file-key").addEventListener("change", () => this.choose());
    at("file-names").addEventListener("change", () => this.choose());
    at("file-form").addEventListener("submit", (event) => { event.preventDefault(); this.submit(); });
  }

  show({ known, why, file, said, takes, names, unit_m: unit }, readOnly) {
    this.size = unit ? `. One unit of the file is ${Number(unit.toPrecision(4))} m now` : "";
    at("file-words").textContent = why || (!known ? "The source is being read." : `Of ${file}. The source is read again with it.`);
    at("file-form").hidden = readOnly || !takes.length;
    const key = at("file-key").value;
    const keys = Object.keys(TITLES).filter((each) => takes.includes(each));
    at("file-key").replaceChildren(...keys.map((each) => new Option(TITLES[each][0], each, false, each === key)));
    at("file-names").replaceChildren(...names.map((name) => new Option(name, name, false, (said.drop_nodes ?? []).includes(name))));
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

  choose() {
    const key = at("file-key").value, nodes = key === "drop_nodes";
    at("file-line").hidden = nodes;
    at("file-nodes").hidden = !nodes;
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

  open() {
    at("file-form").scrollIntoView({ block: "center" });
    at("file-key").focus();
  }

  submit() {
    const key = at("file-key").value;
    const value = key === "drop_nodes" ? this.names.join("\n") : at("file-value").value.trim();
    if (!value) { at("file-value").focus(); return; }
    at("file-value").value = "";
    at("stage").focus({ preventScroll: true }); // keys are answers again
    if (key === "distance") this.hooks.draw((points) => this.hooks.say(key, value, points));
    else this.hooks.say(key, value);
  }
}
