// How the build again stands, and what became of each plan that was decided on: before and after.
const at = (id) => document.getElementById(id);
let shown = "";

export function showBuild(found, base, readOnly) {
  const is = (phase) => found.phase === phase;
  const waiting = found.waiting === 1 ? "1 plan was decided on" : `${found.waiting} plans were decided on`;
  const words = {
    idle: found.waiting ? `${waiting} since the last build` : "No decisions since the last build.",
    building: "Building…", built: found.waiting ? `Built. ${waiting} since.` : "Built.", failed: "The build failed:", stopped: "Stopped; finished houses are kept.",
  };
  at("build-words").textContent = found.refusal || words[found.phase];
  at("build").disabled = readOnly || is("building") || found.refusal !== "";
  at("stop").hidden = !is("building");
  if (is("building")) at("confirm").hidden = true;
  at("commands").textContent = (found.commands ?? []).join("\n");
  at("lines").hidden = !(is("building") || is("failed"));
  at("lines").textContent = found.lines.join("\n");
  const key = JSON.stringify([found.phase, found.outcomes]);
  if (key === shown) return;
  shown = key;
  const isSame = (outcome) => outcome.became === "the same" && !outcome.effects.length && !outcome.idle.length && !outcome.shown;
  const same = found.outcomes.filter(isSame), changed = found.outcomes.filter((outcome) => !isSame(outcome));
  const told = document.createElement("p");
  told.className = "muted";
  const others = same.length === 1 ? "1 plan that was decided on is" : `${same.length} plans that were decided on are`;
  told.textContent = same.length ? `${others} the same as before: ${same.map((outcome) => outcome.plan).join(", ")}.` : "";
  at("outcomes").replaceChildren(...changed.map((outcome) => pair(outcome, base)), ...(same.length ? [told] : []));
}

function pair(outcome, base) {
  const place = document.createElement("div");
  place.className = "outcome";
  const title = document.createElement("h3");
  const why = outcome.why ? `: ${outcome.why}` : "", isNone = outcome.became === "no plan";
  title.textContent = `${outcome.plan}: ${outcome.became}${why}`;
  const both = document.createElement("div");
  both.className = "pair";
  const picture = `${base}/pictures/${encodeURIComponent(outcome.plan)}.svg`;
  const stamp = Date.now();
  both.append(
    figure("Before", isNone || outcome.became === "new" ? "" : `${picture}?when=before&at=${stamp}`, outcome.plan),
    figure("After", isNone || outcome.became === "gone" ? "" : `${picture}?when=built&at=${stamp}`, outcome.plan),
  );
  const told = document.createElement("ul");
  told.className = "effects";
  told.append(
    ...(outcome.shown ? [Object.assign(document.createElement("li"), { textContent: `${outcome.plan}: ${outcome.shown}.`, className: "idle" })] : []),
    ...outcome.idle.map((text) => Object.assign(document.createElement("li"), { textContent: `Correction without effect: ${text}.`, className: "idle" })),
    ...outcome.effects.map((text) => Object.assign(document.createElement("li"), { textContent: `${text}.` })),
  );
  place.append(title, told, both);
  return place;
}

function figure(words, address, plan) {
  const found = document.createElement("figure");
  const caption = Object.assign(document.createElement("figcaption"), { textContent: words, className: "muted" });
  const inside = address
    ? Object.assign(document.createElement("img"), { src: address, alt: `${plan}, ${words.toLowerCase()}`, loading: "lazy" })
    : Object.assign(document.createElement("p"), { textContent: "no plan", className: "none" });
  found.append(caption, inside);
  return found;
}
