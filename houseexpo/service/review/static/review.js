// Review: shows one plan, takes decisions by keyboard, mouse or touch, and asks the server to note each of them.
import { Sheet } from "./sheet.js";
import { showBuild } from "./build.js";
import { showEnd } from "./ended.js";

const root = document.getElementById("review");
const base = root.dataset.base;
const readOnly = root.dataset.readOnly === "yes";
const LOOK_MS = 700;
const at = (id) => document.getElementById(id);
const sheet = new Sheet(at("stage"), at("picture"), at("marks"), at("hint"));
let now = null; // what the server said of the plan that is shown
const seen = new Map(); // by plan, the number of the latest line about it that was shown here
let busy = Promise.resolve(); // one request after the other: keys may come faster than answers
let buildPhase = "";
let buildShown = ""; // stands for the commands that are shown, when they are confirmed
let nextLook = 0; // the timer of the next look at a build
const JAMBS = ["one jamb", "the other jamb"];
// The words of a storey that are drawn: their keys, the points that are asked for, and what a decision is called.
const WORDS = {
  door: ["d", JAMBS, "a door"], entrance: ["e", JAMBS, "an entrance"], opening: ["p", JAMBS, "an opening"],
  wall: ["w", ["one end", "the other end"], "a wall"], no_door: ["t", ["a point in the passage"], "no passage"],
  no_room: ["r", ["a point in it"], "no room"], room: ["i", ["a point in it"], "a room"],
  one_room: ["o", ["a point in one room", "a point in the other"], "one room"], label: ["l", ["a point in the room"], "a label"],
};
let leaving = false; // a plan is judged and the next is on its way: a key that is too fast is not for it

function reviewer() {
  return at("reviewer").value.trim();
}

function say(text, kind = "") {
  at("said").textContent = text;
  at("said").className = `said ${kind}`;
}

async function ask(path, body) {
  const options = body === undefined ? {} : {
    method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(body),
  };
  const answer = await fetch(`${base}/${path}`, options).catch(() => {
    throw new Error("The server does not answer, and the last decision may not be saved. Reload the page when it runs again.");
  });
  const found = await answer.json();
  if (!answer.ok) throw new Error(found.error ?? `the server answered ${answer.status}`);
  return found;
}

function inTurn(work) {
  busy = busy.then(work).catch((error) => say(error.message, "bad"));
  return busy;
}

function go(move, plan = now?.plan) {
  return inTurn(async () => {
    const query = new URLSearchParams({ move, reviewer: reviewer() });
    if (plan) query.set("plan", plan);
    const found = await ask(`state?${query}`);
    if (found.plan === null && now?.plan) {
      now = { ...now, ...found, plan: now.plan };
      showProgress(found.progress);
      sayNone(found);
    } else show(found);
  });
}

function show(found) {
  now = found;
  showProgress(found.progress);
  setBuild(found.build);
  if (found.plan === null) {
    sayNone(found);
    return;
  }
  at("ended").hidden = true;
  seen.set(found.plan, found.seen);
  history.replaceState(null, "", `?plan=${encodeURIComponent(found.plan)}`);
  at("plan").textContent = found.plan;
  at("title").textContent = found.title;
  const sure = found.quality === null ? "no quality" : `quality ${found.quality.toFixed(2)}${found.doubtful ? ", doubtful" : ""}`;
  at("facts").textContent = `${sure} · ${counted(found.rooms, "room")} in the source · ${counted(found.doors, "door")} · ${found.place} of ${found.progress.plans}`;
  const words = { keep: "kept", drop: "dropped", note: "a note", ...Object.fromEntries(Object.entries(WORDS).map(([word, each]) => [word, each[2]])) };
  at("judged").textContent = found.judged
    ? `${found.judged.by}: ${found.judged.actions.map((each) => words[each]).join(", ")}` : "no decision yet";
  at("table").textContent = Object.entries(found.table).map(([key, value]) => `${key} = ${JSON.stringify(value)}`).join("\n") || "no entry yet";
  at("effects").replaceChildren(...found.effects.map(effect));
  at("effects").hidden = found.effects.length === 0;
  at("grounds").replaceChildren(...found.grounds.map(ground));
  if (found.grounds.length === 0) at("grounds").textContent = found.quality === null ? "No quality recorded." : "Nothing.";
  at("unsure").replaceChildren(...found.unsure.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
  for (const id of ["unsure", "unsure_head"]) at(id).hidden = found.unsure.length === 0;
  for (const id of Object.keys(WORDS)) at(id).disabled = readOnly || !found.drawable;
  const stamp = `${found.build.phase}-${found.build.outcomes.length}-${found.seen}`;
  sheet.show(found, `${base}/pictures/${encodeURIComponent(found.plan)}.svg?at=${stamp}`);
}

function sayNone({ progress, summary, build }) {
  if (!progress.plans) { say("The data set has no plans to review."); return; }
  say("All plans are reviewed.", "good");
  showEnd(at("ended"), summary, progress, build);
}

function counted(number, word) {
  return `${number} ${word}${number === 1 ? "" : "s"}`;
}

// What a correction did, or will do in the next build.
function effect({ word, outcome, said, also = [], built }) {
  const line = document.createElement("li");
  line.className = outcome === "none" ? "idle" : "";
  const when = outcome === "none" ? "no effect" : built ? "built" : "in the next build";
  line.textContent = `${word.replace("_", " ")}, ${when}: ${[said, ...also].join("; ")}.`;
  return line;
}

function ground([name, value]) {
  const line = document.createElement("li");
  const meter = Object.assign(document.createElement("meter"), { min: 0, max: 1, low: 0.2, high: 0.6, optimum: 0, value });
  meter.setAttribute("aria-label", name);
  const number = Object.assign(document.createElement("span"), { textContent: value.toFixed(2), className: "number" });
  line.append(name, meter, number);
  return line;
}

function showProgress(progress) {
  const { doubtful, doubtful_judged: done, plans, judged } = progress;
  at("progress").max = Math.max(doubtful || plans, 1);
  at("progress").value = doubtful ? done : judged;
  at("progress-words").textContent = doubtful
    ? `${done} of ${doubtful} doubtful plans reviewed, ${judged} of all ${plans}` : `${judged} of ${plans} plans judged`;
}

function decide(action, { points = [], text = "" } = {}) {
  if (!now?.plan || leaving) return undefined;
  if (readOnly) return say("This service is read-only.", "bad");
  if (!reviewer()) { at("reviewer").focus(); return say("Enter your name first; the log records who decided.", "bad"); }
  const { plan } = now;
  const leaves = action === "keep" || action === "drop";
  leaving = leaves;
  return inTurn(async () => {
    let effect = null;
    try {
      const found = await ask("decide", { plan, action, reviewer: reviewer(), seen: seen.get(plan), points, text });
      effect = found.effect;
      show(found);
    } catch (error) { // somebody may have judged it meanwhile: who is told to look again sees what there is now
      show(await ask(`state?${new URLSearchParams({ move: "here", plan, reviewer: reviewer() })}`));
      throw error;
    }
    const words = { keep: "Kept", drop: "Dropped", note: "Note saved for" };
    if (effect) say(`In the next build of ${plan}: ${[effect.said, ...(effect.also ?? [])].join("; ")}. It is on the disk.`, "good");
    else say(`${words[action]} ${plan}. It is on the disk.`, "good");
    if (leaves) go("open", plan);
  }).then(() => busy).finally(() => { leaving = false; });
}

function undo() {
  if (readOnly) return say("This service is read-only.", "bad");
  return inTurn(async () => {
    const found = await ask("undo", { reviewer: reviewer() });
    if (found.plan !== null) show(found);
    say(`Undone: the last decision on ${found.undone}.`, "good");
  });
}

function draw(kind) {
  if (!now?.plan) return undefined;
  if (at(kind).disabled) return say("The position of this plan in its source is not recorded: keep it or drop it.", "bad");
  const wanted = sheet.wanted === kind ? "" : kind;
  const done = (points) => {
    pressed("");
    if (kind === "label") openLabel(points);
    else decide(kind, { points });
  };
  sheet.draw(wanted, done, WORDS[kind][1]);
  pressed(wanted);
}

function pressed(kind) {
  for (const id of Object.keys(WORDS)) at(id).setAttribute("aria-pressed", String(id === kind));
}

let labelled = []; // where the room lies that is to be named

function openLabel(points) {
  labelled = points;
  at("label-form").hidden = false;
  at("label-text").focus();
}

function openNote() {
  if (!now?.plan) return;
  at("note-form").hidden = false;
  at("note-text").value = now.table.why ?? "";
  at("note-text").focus();
}

function closeNote() {
  for (const id of ["note-form", "label-form"]) at(id).hidden = true;
  at("stage").focus({ preventScroll: true });
}

// What a build runs is shown first; it begins when that is confirmed.
function build() {
  if (readOnly) return say("This service is read-only.", "bad");
  if (!reviewer()) { at("reviewer").focus(); return say("Enter your name first.", "bad"); }
  if (at("build").disabled) return say(at("build-words").textContent, "bad");
  at("confirm").hidden = false;
  at("run").focus();
  return undefined;
}

function cancel() {
  at("confirm").hidden = true;
  at("stage").focus({ preventScroll: true });
}

function run() {
  at("confirm").hidden = true;
  return inTurn(async () => {
    try {
      setBuild(await ask("build", { reviewer: reviewer(), confirm: buildShown }));
    } catch (error) { // the data set says something else now: it is shown, and to be confirmed again
      setBuild(await ask("build"));
      throw error;
    }
  });
}

function setBuild(found) {
  const ended = buildPhase === "building" && found.phase !== "building";
  buildPhase = found.phase;
  buildShown = found.confirm ?? "";
  showBuild(found, base, readOnly);
  if (found.phase === "building") lookSoon();
  else clearTimeout(nextLook);
  if (ended && now?.plan) go("here");
}

// One timer however many answers say that it is being built; a look that fails is not the last.
function lookSoon() {
  clearTimeout(nextLook);
  nextLook = setTimeout(() => inTurn(async () => {
    try {
      setBuild(await ask("build"));
    } catch (error) {
      lookSoon();
      throw error;
    }
  }), LOOK_MS);
}

const KEYS = {
  ...Object.fromEntries(Object.entries(WORDS).map(([word, [key]]) => [key, () => draw(word)])),
  k: () => decide("keep"), x: () => decide("drop"), n: openNote,
  u: undo, b: build, arrowright: () => go("next"), arrowleft: () => go("previous"), " ": () => go("open"),
};

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.target.matches("input, select, textarea")) {
    if (event.key === "Escape") { closeNote(); event.preventDefault(); }
    return;
  }
  if (sheet.key(event)) {
    if (!sheet.wanted) pressed("");
    event.preventDefault();
    return;
  }
  if (event.key === "Escape" && !at("confirm").hidden) { cancel(); event.preventDefault(); return; }
  if (event.target.matches("button, a, pre") && (event.key === " " || event.key === "Enter")) return;
  const work = KEYS[event.key.toLowerCase()];
  if (work) { event.preventDefault(); work(); }
});

for (const id of ["keep", "drop"]) at(id).addEventListener("click", () => decide(id));
for (const id of Object.keys(WORDS)) at(id).addEventListener("click", () => draw(id));
for (const id of ["next", "previous", "open"]) at(id).addEventListener("click", () => go(id));
at("undo").addEventListener("click", undo);
at("note").addEventListener("click", openNote);
at("build").addEventListener("click", build);
at("run").addEventListener("click", run);
at("cancel").addEventListener("click", cancel);
at("stop").addEventListener("click", () => inTurn(async () => setBuild(await ask("stop", {}))));
at("note-form").addEventListener("submit", (event) => {
  event.preventDefault();
  decide("note", { text: at("note-text").value });
  closeNote();
});
at("label-form").addEventListener("submit", (event) => {
  event.preventDefault();
  decide("label", { points: labelled, text: at("label-text").value });
  closeNote();
});
at("reviewer").value = localStorage.getItem("reviewer") ?? root.dataset.reviewer;
at("reviewer").addEventListener("change", () => localStorage.setItem("reviewer", reviewer()));
if (readOnly) for (const id of ["keep", "drop", "note", "undo", "build"]) at(id).disabled = true;

const asked = new URLSearchParams(location.search).get("plan");
go(asked ? "here" : "open", asked).then(() => at("stage").focus({ preventScroll: true }));
