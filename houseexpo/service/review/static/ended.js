// The end of a review: what was decided on how many plans, by whom, and what comes next.
const WORDS = { keep: "kept", drop: "dropped", door: "a door drawn", entrance: "an entrance drawn", opening: "an opening drawn", wall: "a wall drawn", no_door: "a passage taken out", no_room: "marked no room", room: "marked a room", one_room: "rooms made one", label: "a room named", note: "a note" };
const FEW = 24;

export function showEnd(place, { actions, reviewers, from, to }, { plans }, build) {
  const counted = (number, word) => `${number} ${word}${number === 1 ? "" : "s"}`;
  const title = make("h2", `${plans === 1 ? "The plan is" : `All ${plans} plans are`} reviewed`);
  const list = make("ul");
  for (const [action, words] of Object.entries(WORDS)) {
    const ids = actions[action];
    if (!ids) continue;
    const line = make("li", `${counted(ids.length, "plan")}: ${words}`);
    if (action !== "keep") line.append(": ", ...ids.slice(0, FEW).flatMap((id, i) => [i ? ", " : "", link(id)]), ids.length > FEW ? `, and ${ids.length - FEW} more` : "");
    list.append(line);
  }
  const who = Object.entries(reviewers).map(([name, number]) => `${name} (${number})`).join(", ");
  const when = from ? `, from ${local(from)} to ${local(to)}` : "";
  const next = build.waiting === 0 ? "The plans are built with these decisions."
    : build.refusal || "Next: rebuild, below. The decisions take effect in that build.";
  place.replaceChildren(title, list, make("p", `Decided by ${who}${when}.`), make("p", next));
  place.hidden = false;
}

const make = (name, text = "") => Object.assign(document.createElement(name), { textContent: text });
const link = (id) => Object.assign(make("a", id), { href: `?plan=${encodeURIComponent(id)}` });
const local = (time) => new Date(time).toLocaleString([], { dateStyle: "medium", timeStyle: "short" });
