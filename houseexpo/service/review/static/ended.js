// The end of a review: what was decided on how many plans, by whom, and what comes next.
const DONE = { keep: "kept", drop: "dropped" }; // other actions are words of the vocabulary
const FEW = 24;

export function showEnd(place, { actions, reviewers, from, to }, { plans }, build) {
  const counted = (number, word) => `${number} ${word}${number === 1 ? "" : "s"}`;
  const title = make("h2", `${plans === 1 ? "The plan is" : `All ${plans} plans are`} reviewed`);
  const list = make("ul");
  for (const [action, ids] of Object.entries(actions)) {
    const line = make("li", `${counted(ids.length, "plan")}: ${DONE[action] ?? action.replaceAll("_", " ")}`);
    if (action !== "keep") line.append(": ", ...ids.slice(0, FEW).flatMap((id, i) => [i ? ", " : "", link(id)]), ids.length > FEW ? `, and ${ids.length - FEW} more` : "");
    list.append(line);
  }
  const who = Object.entries(reviewers).map(([name, number]) => `${name} (${number})`).join(", ");
  const when = from ? `, from ${local(from)} to ${local(to)}` : "";
  place.replaceChildren(title, list, make("p", `Decided by ${who}${when}.`), make("p"));
  showNext(place, build);
  place.hidden = false;
}

// What comes next changes when a build ends.
export function showNext(place, build) {
  if (place.lastChild?.tagName !== "P") return;
  place.lastChild.textContent = build.waiting === 0 ? "The plans are built with these decisions."
    : build.refusal || "Next: rebuild, below. The decisions take effect in that build.";
}

const make = (name, text = "") => Object.assign(document.createElement(name), { textContent: text });
const link = (id) => Object.assign(make("a", id), { href: `?plan=${encodeURIComponent(id)}` });
const local = (time) => new Date(time).toLocaleString([], { dateStyle: "medium", timeStyle: "short" });
