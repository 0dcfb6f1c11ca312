// Review: shows one plan, takes decisions by keyboard, mouse or touch, and asks the server to note each of them.
import { Sheet, SOLID } from "./sheet.js";
import { showBuild } from "./build.js";
import { showEnd, showNext } from "./ended.js";
import { FileForm } from "./file.js";
import { Solid } from "./solid.js";

const root = document.getElementById("review");
const base = root.dataset.base;
const readOnly = root.dataset.readOnly === "yes";
const LOOK_MS = 700;
const SETTLE_MS = 500; // a key that comes sooner was pressed for the question that was there before: a choice takes about as long
const TICK_MS = 1000;
const mostAlike = () => (now?.rooms ? 200 : 1000); // places of which the same is said at once; without a plan none is tried
const SAME_LENGTH = 1.2; // lines whose lengths differ by a smaller factor look alike
const MOST_SAID = 2; // of what a word changes beside; the list of what is said has all
const LAYER_KEYS = { top: "f", map: "f", lines: "f", section_1_1: "g", section_1_9: "h", places: "q", solid: "v", strokes: "z", said: "," }; // digits answer
const ANY = 9; // all questions of a kind are marked, and no answer is chosen yet
const LEFT = 8; // the number of the last answer to any question, from 0: its key is 9, however many others there are
const LEAVE = { title: "Leave it", action: "leave", points: [] };
const OF_FILE = new Set(["file", "take_out", "grow", "units", "up", "floors", "wall_layers"]); // answers that hold for the whole file
const SEVERAL = "Several rooms"; // an answer to whether a space is a room
const OF_SPACE = { wall: 2, room: 1, door: 2, opening: 2 }; // words that may leave a space open, and the points that each takes
const at = (id) => document.getElementById(id);
const tools = JSON.parse(root.dataset.tools); // the words of a storey, each with its key and the points that it asks for
const titles = {
  keep: "Kept", drop: "Dropped", note: "A note", file: "Of the file", leave: "Left a question", move: "Moved", remove: "Taken out", build: "Rebuilt",
  ...Object.fromEntries(tools.map(({ word, title }) => [word, title])),
};
const sheet = new Sheet(at("stage"), at("hint"), { choose: showChosen, move, take: (word, points) => decide(word, { points }), stroke: askOfStroke, only: askOnly, part: (name) => file.toggle(name) });
const solid = new Solid(at("solid"), at("solid-view"), at("solid-cut"));
const file = new FileForm({ draw: drawDistance, say: sayOfFile, parts: (names, picks) => sheet.showParts(names, picks) });
let held = ""; // the key of the question on the screen
let settled = 0; // when a question that took the place of another, which nobody answered, takes keys; milliseconds
let wantedKind = ""; // the kind of question that the reviewer has chosen to answer now
let wide = false; // whether all of the kind are marked, and not only those that look alike
let forAll = -1; // the answer that is about to be given to all questions of a kind: -1 if none is, ANY before one is chosen
const answered = new Map(); // questions about places that were answered here, by key, with the bounds of the plan at that time
let parting = null; // the place of the room that the last answer was several rooms: where it parts is asked next
let partsNowhere = false; // whether no place of it is known
let elsewhere = false; // whether the next undo is of a decision on another plan
let strokes = []; // questions about lines of the drawing, the one that was clicked first
let reading = ""; // the plan whose source is on its way, and what was said of its file when it was asked for
let laid = ""; // the same of the source that is shown
let failure = ""; // why a source could not be read, as it was said
let read = { plan: "", since: 0 }; // which plan that is, and since when, milliseconds
let now = null; // what the server said of the plan that is shown
let likes = new Map(); // the group of each of them, as it was when the question came
let asking = new Set(); // the keys of all questions of the plan that is shown
const seen = new Map(); // by plan, the number of the latest line about it that was shown here
let working = 0; // decisions that were sent, or wait to be sent, and have no reply yet
let busy = Promise.resolve(); // one request after the other: keys may come faster than answers
let buildPhase = "";
let buildShown = ""; // stands for the commands that are shown, when they are confirmed
let nextLook = 0; // the timer of the next look at a build
let leaving = false; // a plan is judged and the next is on its way: a key that is too fast is not for it
let moving = 0; // other plans that were asked for and are on their way

function reviewer() {
  return at("reviewer").value.trim();
}

// Words of the file as the page names them, and what was said earlier without its points.
const NAMES = new Map(tools.map(({ word, title, key }) => [word, `${title} (${key.toUpperCase()})`]));
const WORD = tools.map(({ word }) => word).join("|"), LONG_WORD = tools.flatMap(({ word }) => (word.includes("_") ? [word] : [])).join("|");
const inWords = (text) => text
  .replace(new RegExp(`\\b(${WORD}) \\[[-\\d., \\[\\]]*\\]`, "g"), (_, word) => `the earlier ${word.replaceAll("_", " ")}`)
  .replace(new RegExp(`^(${WORD})(?=: )|(?<=\\bsay )(${WORD})\\b|\\b(${LONG_WORD})\\b`, "g"), (word) => NAMES.get(word));

function say(text, kind = "") {
  at("said").textContent = inWords(text);
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

// A decision, which may take a minute: a note in the plan says so until the reply.
function decideInTurn(work) {
  working += 1;
  say("");
  showDoing();
  return inTurn(async () => {
    try { await work(); } finally { working -= 1; showDoing(); }
  });
}

// What takes long: decisions without a reply yet, and the source that is on its way or could not be read.
function showDoing() {
  const { why = "", can_be_read: again = false, is_outdated: outdated = false } = now?.source ?? {}, seconds = Math.round((performance.now() - read.since) / 1000);
  const isFirst = reading && read.plan !== now?.plan;
  const words = [
    ...moving ? ["Opening another plan…"] : [],
    ...working ? [working > 1 ? `Working on ${working} decisions…` : "Working on the last decision…"] : [],
    ...reading ? [isFirst ? `Reading the source of ${read.plan} first…` : outdated
      ? "Reading the file with what is said of it; the plan is that of before…" : "Reading the source of this plan; go on meanwhile…"] : [],
    ...!reading && why && again ? ["The source could not be read."] : [],
  ].join(" ");
  if (at("doing-words").textContent !== words) at("doing-words").textContent = words;
  at("doing-time").textContent = reading && seconds > 1 ? ` ${seconds} s` : "";
  at("again").hidden = reading || !why || !again;
  at("doing").hidden = !words;
}

// A key for a question while its successor is not known yet, or has just come.
function refuseEarly() {
  if (performance.now() < settled) return say("The last key was not taken: another question has come in the meantime.", "bad");
  return working || reading ? say("The last key was not taken: no question is shown yet.", "bad") : undefined;
}

function go(move, plan = now?.plan) {
  const leaves = move !== "here" || plan !== now?.plan;
  if (leaves) moving += 1;
  showDoing();
  return inTurn(async () => {
    if (!leaves && plan !== now?.plan) return; // a look at a plan that is not shown any more would bring it back
    const query = new URLSearchParams({ move, reviewer: reviewer() });
    if (plan) query.set("plan", plan);
    const found = await ask(`state?${query}`).finally(() => { if (leaves) moving -= 1; showDoing(); });
    if (found.plan === null && now?.plan) {
      now = { ...now, ...found, plan: now.plan };
      showProgress(found.progress);
      sayNone(found);
    } else show(found);
    if (move === "open" && plan && found.plan === plan) say("All other plans are kept or dropped.");
  });
}

// Shows what the server said of a plan; `again` is the key of a question that is asked again.
function show(found, again = "") {
  if (found.plan !== now?.plan) { elsewhere = false; forgetFailure(); }
  if (found.plan !== now?.plan || found.seen !== now.seen) at("ended").hidden = true;
  const asked = found.plan === now?.plan ? questions()[0] : undefined;
  holdQuestion(found);
  if (again) askAgain(found, again);
  if (found.source?.known && laid !== readingOf(found)) sheet.source = null; // it was read with something else that is said of the file
  now = found;
  showProgress(found.progress);
  setBuild(found.build);
  showRejections(found);
  if (found.plan === null) {
    const [first] = Object.keys(found.rejections);
    if (found.progress.plans) go("here").then(() => sayNone(found)); // all are reviewed: the first one
    else if (first) go("here", first);
    else sayNone(found);
    return;
  }
  seen.set(found.plan, found.seen);
  history.replaceState(null, "", `?plan=${encodeURIComponent(found.plan)}`);
  at("plan").textContent = found.plan;
  at("title").textContent = found.title;
  const sure = found.quality === null ? "no quality" : `quality ${found.quality.toFixed(2)}${found.doubtful ? ", doubtful" : ""}`;
  at("facts").textContent = found.rejected ? found.source.rejected || found.rejected : `${sure} · ${counted(found.rooms, "room")} in the source · ${counted(found.doors, "door")} · ${found.place} of ${found.progress.plans}`;
  at("judged").textContent = found.judged
    ? `${found.judged.by}: ${found.judged.actions.map((each) => titles[each].toLowerCase()).join(", ")}` : "no decision yet";
  at("table").textContent = Object.entries(found.table).map(([key, value]) => `${key} = ${JSON.stringify(value)}`).join("\n") || "no entry yet";
  at("history").replaceChildren(...found.history.map(step));
  at("grounds").replaceChildren(...found.grounds.map(ground));
  if (found.grounds.length === 0) {
    const nothing = found.quality === null ? "No quality recorded." : "Nothing.";
    at("grounds").append(Object.assign(document.createElement("li"), { textContent: nothing }));
  }
  at("unsure").replaceChildren(...found.unsure.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
  for (const id of ["unsure", "unsure_head"]) at(id).hidden = found.unsure.length === 0;
  for (const { word } of tools) at(word).disabled = readOnly || !found.drawable || found.source.is_outdated;
  sheet.show(found);
  if (!sheet.source) file.lookFrom(null);
  readSource(found);
  showSwitches();
  file.show(found.source, readOnly);
  strokes = [];
  if (found.source.changed) say(`${found.source.changed}. ${found.source.rejected ? "U takes back what you said last" : "B builds it"}.`, found.source.rejected ? "bad" : "");
  showQuestions();
  if (asked && isOther(asked, questions()[0])) settled = performance.now() + SETTLE_MS;
  showDoing();
  at("storeys").hidden = found.storeys.length === 0;
  at("storeys").replaceChildren(...found.storeys.map(({ plan, title }) => {
    const tab = button(title, () => go("here", plan), "storey");
    tab.setAttribute("aria-pressed", String(plan === found.plan));
    return tab;
  }));
  at("effects").replaceChildren(...found.effects.map(effect));
  for (const id of ["effects", "effects_head"]) at(id).hidden = found.effects.length === 0;
}

// An undone answer's question comes again, also one that was asked before the source was known and would not be asked now.
function askAgain(found, key) {
  const { question, bounds } = answered.get(key) ?? {};
  const isThere = found.questions?.some((each) => each.key === key);
  if (!isThere && (!question || bounds !== JSON.stringify(found.shape?.bounds))) return;
  if (!isThere) found.questions.unshift(question);
  held = key;
}

// Has the source of the plan read, once for what is said of the file, and shows it under the plan.
function readSource({ plan, source: { known, why } }) {
  if (reading || (known && sheet.source) || why) return;
  const isLate = () => readingOf(now) !== reading; // another plan is shown, or the file was said to be another
  reading = readingOf(now);
  read = { plan, since: performance.now() };
  ask(`source?${new URLSearchParams({ plan })}`).then((found) => {
    if (isLate()) return undefined;
    const isOfPlan = known || sheet.isAt(found.frame); // else the plan is another one with what is said of the file: both change at once
    if (isOfPlan) lay(found);
    return known ? undefined : go("here", plan).then(() => { // with the questions that the source answers
      if (!isLate() && !isOfPlan) lay(found);
    });
  }).catch(async (error) => {
    if (isLate()) return;
    say(error.message, "bad");
    failure = at("said").textContent;
    await go("here", plan); // whether it can be read again
    if (isLate()) return;
    now.source.why ||= error.message;
    file.show(now.source, readOnly);
  })
    .finally(() => {
      const wasLate = isLate();
      reading = "";
      if (now?.plan && wasLate) readSource(now);
      showDoing();
    });
}

function readAgain() {
  now.source.why = "";
  readSource(now);
  showDoing();
}

function forgetFailure() {
  if (failure && at("said").textContent === failure) say("");
}

function lay(source) {
  laid = readingOf(now);
  forgetFailure();
  sheet.under(source);
  file.lookFrom(source.side);
  showSide();
  showSwitches();
}

const readingOf = (found) => JSON.stringify([found?.plan, found?.source?.said]);

function showSwitches() {
  const switches = sheet.switches;
  at("switches").hidden = switches.length === 0;
  at("switches").replaceChildren(...switches.map(({ name, title, on }) => {
    const found = button(` ${title}`, () => toggleLayer(name), "switch");
    found.prepend(Object.assign(document.createElement("kbd"), { textContent: LAYER_KEYS[name].toUpperCase() }));
    found.setAttribute("aria-pressed", String(on));
    return found;
  }));
  showSolid();
}

function toggleLayer(name) {
  if (!sheet.switches.some((each) => each.name === name)) return;
  sheet.toggle(name);
  showSwitches();
}

function showSolid() {
  const { source } = sheet, { plan } = now;
  if (!sheet.switches.some(({ name, on }) => name === SOLID && on)) { solid.hide(); return; }
  if (solid.source === source) { solid.mark(now.shape, sheet.asked); return; }
  solid.source = source;
  say("Drawing the source in three dimensions…");
  ask(`solid?${new URLSearchParams({ plan })}`).then((found) => {
    if (sheet.source !== source || !found.corners) return;
    if (at("said").textContent.startsWith("Drawing")) say("");
    solid.show(found, now.shape, sheet.asked);
  }).catch((error) => say(error.message, "bad"));
}

function showRejections({ rejections, plan }) {
  const all = Object.entries(rejections);
  for (const id of ["rejections", "rejections_head"]) at(id).hidden = all.length === 0;
  at("rejections").replaceChildren(...all.map(([name, why]) => {
    const line = document.createElement("li"), open = button(`${name}: ${why}`, () => go("here", name), "rejection");
    if (name === plan) open.setAttribute("aria-current", "true");
    line.append(open);
    return line;
  }));
}

function nextRejected() {
  const names = Object.keys(now?.rejections ?? {});
  if (!names.length) return say("No house of this data set is without a plan.");
  return go("here", names[(names.indexOf(now.plan) + 1) % names.length]);
}

function drawDistance(done) {
  if (!now?.plan || !now.shape) return;
  sheet.draw({ word: "distance", title: "A known distance", key: "", points: 2, more: false, text: false, snaps: true }, done);
}

function sayOfFile(key, value, points = []) {
  if (!mayWrite()) return undefined;
  const { plan } = now;
  return decideInTurn(async () => {
    const found = await ask("file", { plan, key, value, points, reviewer: reviewer() }).catch(async (error) => {
      await showAgain(plan);
      throw error;
    });
    say(`Said of the file: ${key.replaceAll("_", " ")}. It is on the disk; the source is read with it.`, "good");
    show(found);
  });
}

function sayNone({ progress, summary, build }) {
  if (!progress.plans) { say("The data set has no plans to review."); return; }
  say("All plans are reviewed.", "good");
  showEnd(at("ended"), summary, progress, build);
}

function counted(number, word) {
  return `${number} ${word}${number === 1 ? "" : "s"}`;
}

// What a correction did, or will do in the next build; a button chooses it, another takes it out.
function effect({ word, outcome, said, also = [], built, ghost, waits }, number) {
  const line = document.createElement("li");
  line.className = outcome === "none" && !waits ? "idle" : "";
  const when = ghost ? "said of the file as it was" : waits ? "waits for more" : outcome === "none" ? "no effect" : built ? "built" : "in the next build";
  const name = `${word.replaceAll("_", " ")}, ${when}`;
  const choose = button(inWords(`${name}: ${[said, ...also].join("; ")}.`), () => sheet.choose(number), "choose");
  const out = button("×", () => remove(number), "out");
  out.setAttribute("aria-label", `Take out: ${name}`);
  out.disabled = readOnly;
  line.append(choose, out);
  return line;
}

function button(text, work, kind) {
  const found = Object.assign(document.createElement("button"), { type: "button", textContent: text, className: kind });
  found.addEventListener("click", work);
  return found;
}

function showChosen(number) {
  [...at("effects").children].forEach((line, i) => line.classList.toggle("chosen", i === number));
}

// Questions of a kind doubt the same thing, and have the same answers; those of one size look alike.
const kindOf = ({ key, answers }) => JSON.stringify([key.split(" at ")[0], answers.slice(0, 2).map(({ action }) => action)]);
const groupOf = (question) => `${kindOf(question)} ${question.like ?? ""}`;
const KINDS = { // of one, and of several
  changed: ["of the file"], guess: ["of the file"], floors: ["of the floors"], cut: ["cut", "cuts"], entrance: ["entrance", "entrances"], door: ["door", "doors"],
  opening: ["opening", "openings"], room: ["room", "rooms"], meet: ["pair of rooms that meet", "pairs of rooms that meet"],
  seen: ["space seen in part", "spaces seen in part"], parted: ["pair of rooms with a way", "pairs of rooms with a way"],
  space: ["space left out", "spaces left out"], place: ["place for a door", "places for doors"], corner: ["narrow place", "narrow places"],
  larger: ["room in a larger space", "rooms in larger spaces"], wall: ["wall seen", "walls seen"], stroke: ["line", "lines"], gap: ["gap"],
  front: ["open front", "open fronts"], bay: ["bay of a room", "bays of rooms"],
  layer: ["layer"], "corner of a mouth": ["part behind a mouth", "parts behind mouths"], "corner of a part": ["part between walls", "parts between walls"],
};

// All that is asked, what is asked now first: lines that were clicked, then what is on the screen, then the kind that was chosen.
function questions() {
  const all = [...strokes, ...now?.questions ?? []];
  const rank = (each) => (each.key === held ? 0 : groupOf(each) === wantedKind ? 1 : 2);
  return strokes.length ? all : all.sort((a, b) => rank(a) - rank(b));
}

// The question on the screen stays first until it is answered, also if a source that was read in the meantime asks others.
function holdQuestion(found) {
  holdGroups(found);
  const asked = found.plan && found.plan === now?.plan && !strokes.length ? questions()[0] : undefined;
  const isNext = ({ key, at: place }) => (parting ? /^(corner|wall|bay)/.test(key) && sheet.isInOneRoom([parting, place])
    : key.startsWith("entrance") && !asking.has(key)); // an answer has made an entrance, which is asked about next
  const isSameSource = readingOf(found) === readingOf(now) && found.source?.known === now?.source?.known;
  const raised = isSameSource && found.questions?.find(isNext);
  partsNowhere = parting && !raised;
  parting = null;
  asking = new Set(found.questions?.map(({ key }) => key));
  held = (asked ?? (raised || undefined))?.key ?? "";
  const isLost = forAll >= 0 && found.plan === now?.plan;
  mark(-1); // there may be more alike than were marked
  if (isLost) say("The plan or its source has come anew: mark the places once more.", "bad");
  const isSame = asked && found.seen === now.seen && JSON.stringify(found.shape?.bounds) === JSON.stringify(now.shape?.bounds);
  if (isSame && found.questions.every(({ key }) => key !== held)) found.questions.unshift(asked);
}

// A group holds until it is answered: without the part that an answer was about, the others may be too different.
function holdGroups({ plan, questions = [] }) {
  const before = plan === now?.plan ? likes : new Map();
  for (const each of questions) each.like = before.get(each.key) ?? each.like;
  likes = new Map(questions.map(({ key, like }) => [key, like]));
}

const isOther = (one, other) => JSON.stringify([one.key, one.answers]) !== JSON.stringify([other?.key, other?.answers]);

// One of the places that are marked is asked about alone.
function askOnly(key) {
  held = key;
  mark(-1);
  showQuestions();
  say("Only this place is asked about now.");
}

function alike(isWide = wide) {
  const all = questions(), of = isWide ? kindOf : groupOf;
  return all.filter((each) => of(each) === of(all[0]));
}

function mark(which, isWide = false) {
  if (forAll >= 0 && which < 0) say(""); // the line says what is marked
  forAll = which;
  wide = isWide;
}

// Places may be more than one decision takes.
function nearestWords() {
  const [{ of = forAll < 0 ? 0 : alike().length, ofAll = of }] = questions(), count = wide ? ofAll : of;
  return count > mostAlike() ? `The nearest ${mostAlike()} of ${count.toLocaleString("en")}` : "";
}

function markedWords() {
  return nearestWords() ? `${nearestWords()} ${strokes.length ? "lines" : "places"} are marked` : `${alike().length} places are marked`;
}

// Marks all that look alike, then all of the kind, then none.
function widen() {
  if (!questions().length || performance.now() < settled) return refuseEarly();
  const [some, all] = [alike(false).length, alike(true).length];
  if (forAll < 0 && all > 1) mark(ANY, some < 2);
  else if (forAll >= 0 && !wide && all > some) mark(ANY, true);
  else mark(-1);
  showQuestions();
  if (forAll < 0) return say("No places are marked: the next answer counts for this one.");
  return say(`${markedWords()}: the next answer counts for all of them. Shift-0 ${wide || all === some ? "unmarks them" : `marks all ${all} of this kind`}.`);
}

function showQuestions() {
  const all = questions(), [first] = all, like = first ? alike() : [];
  if (!first) mark(-1);
  at("asked").hidden = !first || readOnly;
  sheet.ask(first ?? null, forAll < 0 ? [] : like, forAll in (first?.answers ?? []) ? forAll : 0);
  showSolid();
  if (!first) return;
  at("question").textContent = first.says;
  showSide();
  at("answers").replaceChildren(...[...Object.entries(first.answers.slice(0, LEFT)), [LEFT, LEAVE]].map(([number, { title }]) => {
    const i = Number(number), found = button(` ${title}`, (event) => (event.shiftKey ? answerAll(i) : answer(i)), "answer");
    found.prepend(Object.assign(document.createElement("kbd"), { textContent: i + 1 }));
    found.setAttribute("aria-keyshortcuts", i + 1);
    return found;
  }));
  const [some, whole] = [alike(false).length, alike(true).length], next = forAll < 0 && some > 1 ? some : whole;
  at("all").hidden = whole < 2 || first.answers.some(({ action }) => OF_FILE.has(action));
  at("all").replaceChildren(Object.assign(document.createElement("kbd"), { textContent: "Shift 0" }), ` ${nearestWords() || `All ${next} ${next > some ? "of this kind" : "like this"}`}`);
  at("all").setAttribute("aria-pressed", String(forAll >= 0));
  const kinds = [...new Map(all.map((each) => [groupOf(each), each])).entries()];
  at("kinds").hidden = kinds.length < 2;
  at("kinds").replaceChildren(...kinds.map(([kind, { key, like: size }]) => {
    const name = key.split(" at ")[0], words = KINDS[name] ?? KINDS[name.split(" ")[0]], count = all.filter((each) => groupOf(each) === kind).length;
    const tab = button(`${count} ${words.at(count > 1 ? -1 : 0)}${size ? `: ${size}` : ""}`, () => { sheet.draws = false; wantedKind = kind; held = ""; strokes = []; mark(-1); showQuestions(); }, "kind");
    tab.setAttribute("aria-pressed", String(kind === groupOf(first)));
    return tab;
  }));
}

// The floors are asked about beside the picture of the file from the side, which comes with its source.
function showSide() {
  at("side").hidden = !file.side || !questions()[0]?.key.startsWith("floors");
}

const answerOf = (question, which) => (which === LEFT ? question && LEAVE : question?.answers[which]);

// One answer to all questions of a kind: their places are marked first, and the same key again answers them, as one decision.
function answerAll(which) {
  const [first] = questions(), chosen = answerOf(first, which);
  if (!chosen || performance.now() < settled) return refuseEarly();
  if (!mayWrite()) return undefined;
  if (alike(true).length < 2) return say(`Nothing else is like this: ${which + 1} without Shift answers it.`);
  const { action, title } = chosen;
  if (OF_FILE.has(action)) return undefined;
  if (forAll !== which) {
    mark(which, forAll < 0 ? alike(false).length < 2 : wide);
    showQuestions();
    return say(`${markedWords()}. Shift-${which + 1} again, or Enter, says “${title}” of all of them; Escape does not.`);
  }
  return answer(which);
}

function endForAll() {
  if (forAll < 0 && !strokes.length) return false;
  mark(-1);
  strokes = [];
  showQuestions();
  say("");
  return true;
}

// What is to be said of a line of the drawing, and of those like it: the lines of its layer.
function askOfStroke(segments, kind) {
  const far = ([[ax, ay], [bx, by]]) => Math.hypot(ax - bx, ay - by), long = far(segments[0]);
  const isLike = (ends) => !now.rooms || (far(ends) < SAME_LENGTH * long && long < SAME_LENGTH * far(ends)); // without a plan, a layer is walls or none
  const near = [...segments.filter(isLike), ...segments.filter((ends) => !isLike(ends))];
  strokes = near.slice(0, mostAlike()).map((ends) => ({
    of: segments.filter(isLike).length,
    ofAll: segments.length,
    like: isLike(ends) ? "of this length" : "of another length",
    key: `stroke ${kind} at ${ends.flat().join(", ")}`, at: [(ends[0][0] + ends[1][0]) / 2, (ends[0][1] + ends[1][1]) / 2],
    says: `A line of ${far(ends).toFixed(2)} m, “${kind}” in the drawing. Is it a wall?`,
    answers: [{ title: "A wall", action: "wall", points: ends }, { title: "No wall", action: "no_wall", points: ends }, ...now.rooms ? [{ title: "A door", action: "door", points: sheet.doorAt(ends) }] : []],
  }));
  mark(-1);
  showQuestions();
}

function answer(which) {
  const [first] = questions(), chosen = answerOf(first, which);
  if (!chosen || performance.now() < settled) return refuseEarly();
  if (!mayWrite()) return undefined;
  sheet.draws = false;
  if (chosen.action === "file") return file.open(first.key.startsWith("floors") ? "floors" : "");
  if (chosen.action === "take_out" || chosen.action === "grow") return changeGhosts(chosen.action === "grow");
  if (OF_FILE.has(chosen.action)) {
    now.questions = [];
    return sayOfFile(chosen.action, chosen.text);
  }
  if (chosen.action === "leave" && strokes.length) return endForAll();
  if (!strokes.length) answered.set(first.key, { question: first, bounds: JSON.stringify(now.shape.bounds) });
  const far = ({ at: [x, y] }) => Math.hypot(x - first.at[0], y - first.at[1]);
  const same = forAll >= 0 ? alike().filter((each) => answerOf(each, which)?.action === chosen.action) : [first];
  const all = same.sort((one, other) => far(one) - far(other)).slice(0, mostAlike());
  mark(-1);
  strokes = [];
  now.questions = []; // a key that is too fast is not for the next question
  const text = chosen.action === "leave" ? all.map(({ key }) => key).join("\n") : "";
  const confirms = chosen.action === "leave" && chosen !== LEAVE ? chosen.title : "";
  parting = confirms === SEVERAL ? first.at : null;
  const then = all.flatMap(({ answers }) => answers[which]?.then ?? []);
  return decide(chosen.action, { answer: confirms, question: first.key, points: chosen.points, text, then, more: chosen.action === "leave" ? [] : all.flatMap(({ answers }, i) => [...(i ? [answers[which].points] : []), ...answers[which].more ?? []]) });
}

function changeGhosts(grow) {
  const { plan } = now, gone = now.effects.filter(({ ghost }) => ghost);
  now.questions = [];
  const told = grow ? "Scaled" : "Taken out";
  for (const { word, value, grown } of gone) decideInTurn(async () => sayEffect(await send("replace", plan, { word, value, ...(grow && { by: grown }) }), plan, `${told}: ${word.replaceAll("_", " ")}.`));
}

function step({ action, keys, by, holds, answer: confirms }) {
  const line = document.createElement("li");
  line.className = holds ? "" : "undone";
  line.textContent = `${confirms ? confirmed(confirms) : action === "file" ? `Of the file: ${keys.join(", ").replaceAll("_", " ")}` : titles[action]} (${by})${holds ? "" : ", undone"}`;
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
    ? `${done} of ${doubtful} doubtful plans have decisions, ${judged} of all ${plans}` : `${judged} of ${plans} plans have decisions`;
}

function mayWrite() {
  if (!now?.plan) return false;
  if (leaving || moving) { say("The last key was not taken: another plan is on its way.", "bad"); return false; }
  if (readOnly) { say("This service is read-only.", "bad"); return false; }
  if (reviewer()) return true;
  at("reviewer").focus();
  say("Enter your name first; the log records who decided.", "bad");
  return false;
}

// Sends what is asked about a plan, and shows the answer; what somebody else did in the meantime is shown too.
async function send(path, plan, body) {
  try {
    const found = await ask(path, { plan, reviewer: reviewer(), seen: seen.get(plan), ...body });
    show(found);
    return found;
  } catch (error) {
    await showAgain(plan);
    throw error;
  }
}

async function showAgain(plan) {
  show(await ask(`state?${new URLSearchParams({ move: "here", plan, reviewer: reviewer() })}`));
}

function sayEffect({ effect }, plan, otherwise) {
  const also = effect?.also ?? [], more = also.length > MOST_SAID ? `; ${also.length - MOST_SAID} more below` : "";
  if (effect) say(`In the next build of ${plan}: ${[effect.said, ...also.slice(0, MOST_SAID)].join("; ")}${more}. It is on the disk.`, "good");
  else say(`${otherwise} It is on the disk.${partsNowhere ? " No place is known at which the room may part: draw a wall (W) or an opening (P)." : ""}`, "good");
}

const confirmed = (answer) => (answer === "Right" || answer === SEVERAL ? answer : `Right: ${answer[0].toLowerCase()}${answer.slice(1)}`);

// What is no wall may be a thing that the file has a name for.
function sayPart(points) {
  const part = sheet.partAt(points), size = ([a, b, c, d]) => (c - a) * (d - b);
  return part && size(part.box) < size(now.shape.bounds) / 2 ? ` It may be “${part.name}” of the file: “Parts to leave out” takes all of it out.` : "";
}

function decide(action, { points = [], text = "", more = [], then = [], answer: confirms = "", question = "" } = {}) {
  if (!mayWrite()) return undefined;
  const { plan } = now;
  const leaves = action === "keep" || action === "drop";
  leaving = leaves;
  return decideInTurn(async () => {
    const part = action === "no_wall" ? sayPart(points) : "";
    const words = { keep: "Kept", drop: "Dropped", note: "Note saved for", leave: confirms ? `${confirmed(confirms)}, in` : "Left a question about" };
    try {
      sayEffect(await send("decide", plan, { action, points, text, more, then, answer: confirms, question }), plan, `${words[action]} ${plan}.`);
      at("said").textContent += part;
    } catch (error) {
      error.message += part && `.${part}`;
      throw error;
    } finally {
      if (now?.plan === plan) askOfGap(plan, action, points);
    }
    if (leaves) go("open", plan);
  }).then(() => busy).finally(() => { leaving = false; });
}

// Where the space is still open after a wall, or a room that could not be made: the gap is asked about, and one more wall shuts it.
function askOfGap(plan, action, points) {
  if (!OF_SPACE[action] || points.length !== OF_SPACE[action]) return;
  const { seen: when, effects } = now;
  if (action !== "wall" && action !== "room" && !effects.some(({ word, waits }) => word === action && waits)) return; // it parts a room
  ask(`gap?${new URLSearchParams({ asked: JSON.stringify({ plan, points }) })}`).then((found) => {
    if (!found.key || now?.plan !== plan || now.seen !== when || strokes.length) return;
    strokes = [found];
    showQuestions();
  }).catch(() => {}); // it is an offer
}

// Something that is said is named by its word and value: others may stand before it when the request is sent.
function move(number, points) {
  if (!mayWrite()) return undefined;
  const { plan, effects: { [number]: { word, value } } } = now;
  const text = typeof value.at(-1) === "string" ? value.at(-1) : "";
  return decideInTurn(async () => sayEffect(await send("replace", plan, { word, value, points, text }), plan, "Moved."));
}

function remove(number) {
  if (number < 0 || !now?.effects[number] || !mayWrite()) return undefined;
  const { plan, effects: { [number]: { word, value, built } } } = now;
  const later = built ? " The plan was built with it, and is without it after the next build." : "";
  return decideInTurn(async () => sayEffect(await send("replace", plan, { word, value }), plan, `Taken out: ${word.replaceAll("_", " ")}.${later}`));
}

// On the plan that is shown; what was decided on another one is taken back by a second press only.
function undo() {
  if (readOnly) return say("This service is read-only.", "bad");
  return withoutQuestion(takeBack);
}

// Until the reply, no key answers: the question on the screen may not be the one that stays.
function withoutQuestion(work) {
  const plan = now?.plan;
  if (now) now.questions = [];
  return decideInTurn(() => work().catch(async (error) => {
    if (plan) await showAgain(plan);
    throw error;
  }));
}

async function takeBack() {
  const found = await ask("undo", { reviewer: reviewer(), plan: elsewhere ? "" : now?.plan ?? "" });
  if (found.plan !== null) show(found, found.asked);
  elsewhere = Boolean(found.elsewhere);
  if (elsewhere) say(`You have nothing to undo on this plan. U again takes back the last decision on ${found.elsewhere}, and shows it.`);
  else say(`Undone: the last decision on ${found.undone}.`, "good");
}

function redo() {
  if (readOnly) return say("This service is read-only.", "bad");
  return withoutQuestion(async () => {
    const found = await ask("redo", { reviewer: reviewer() });
    if (found.plan !== null) show(found);
    say(`Made again: the last decision that was undone, on ${found.redone}.`, "good");
  });
}

function draw(kind) {
  if (!now?.plan) return undefined;
  if (now.source.is_outdated) return say("The file is being read with what is said of it; draw when the new plan is shown.", "bad");
  if (at(kind).disabled) return say("The position of this plan in its source is not recorded: keep it or drop it.", "bad");
  if (sheet.wanted === kind) { sheet.draw(null); pressed(""); return undefined; }
  const tool = tools.find(({ word }) => word === kind);
  sheet.draw(tool, (points) => {
    pressed("");
    if (tool.text) openLabel(points);
    else decide(kind, { points });
  });
  pressed(kind);
  return undefined;
}

function pressed(kind) {
  for (const { word } of tools) at(word).setAttribute("aria-pressed", String(word === kind));
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
  showNext(at("ended"), found);
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
  ...Object.fromEntries(tools.map(({ word, key }) => [key, () => draw(word)])),
  k: () => decide("keep"), x: () => decide("drop"), n: openNote,
  j: nextRejected,
  ...Object.fromEntries(Object.values(LAYER_KEYS).map((key) => [key, () => Object.keys(LAYER_KEYS).filter((name) => LAYER_KEYS[name] === key).forEach(toggleLayer)])),
  ...Object.fromEntries([1, 2, 3, 4, 5, 6, 7, 8, 9].map((digit) => [digit, () => answer(digit - 1)])),
  u: undo, y: redo, delete: () => remove(sheet.chosen), backspace: () => remove(sheet.chosen), b: build, arrowright: () => go("next"), arrowleft: () => go("previous"), " ": () => go("open"),
};

window.addEventListener("beforeunload", (event) => { if (working) event.preventDefault(); }); // what waits its turn is not sent yet
document.addEventListener("keydown", (event) => {
  const isSlider = event.target.matches("[type=range]"), isText = !isSlider && event.target.matches("input, select, textarea");
  if ((event.ctrlKey || event.metaKey) && !isText && event.key.toLowerCase() === "z") {
    event.preventDefault();
    (event.shiftKey ? redo : undo)();
    return;
  }
  if (event.ctrlKey || event.metaKey || (isSlider && /^(Arrow|Page|Home|End)/.test(event.key))) return;
  if (isText) {
    if (event.key === "Escape") { closeNote(); event.preventDefault(); }
    return;
  }
  if (event.shiftKey && event.code === "Digit0" && !sheet.wanted) { event.preventDefault(); widen(); return; } // "=" on some keyboards
  if (sheet.key(event)) {
    if (!sheet.wanted) pressed("");
    event.preventDefault();
    return;
  }
  if (event.key === "Escape" && !at("confirm").hidden) { cancel(); event.preventDefault(); return; }
  if (event.key === "Escape" && endForAll()) { event.preventDefault(); return; }
  if (event.key === "Enter" && forAll >= 0 && forAll < ANY && !event.target.matches("button, a, pre")) { event.preventDefault(); answer(forAll); return; }
  if (event.target.matches("button, a, pre") && (event.key === " " || event.key === "Enter")) return;
  if (event.shiftKey && /^Digit[1-9]$/.test(event.code)) { event.preventDefault(); answerAll(Number(event.code.at(-1)) - 1); return; }
  const work = KEYS[event.altKey ? event.code.replace("Key", "").toLowerCase() : event.key.toLowerCase()]; // who draws freely holds Alt already
  if (work) { event.preventDefault(); work(); }
});

for (const id of ["keep", "drop"]) at(id).addEventListener("click", () => decide(id));
for (const { word } of tools) at(word).addEventListener("click", () => draw(word));
for (const id of ["next", "previous", "open"]) at(id).addEventListener("click", () => go(id));
at("all").addEventListener("click", widen);
at("again").addEventListener("click", readAgain);
setInterval(() => { if (reading) showDoing(); }, TICK_MS);
at("undo").addEventListener("click", undo);
at("redo").addEventListener("click", redo);
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
if (readOnly) for (const id of ["keep", "drop", "note", "undo", "redo", "build"]) at(id).disabled = true;

const asked = new URLSearchParams(location.search).get("plan");
go(asked ? "here" : "open", asked).then(() => at("stage").focus({ preventScroll: true }));
