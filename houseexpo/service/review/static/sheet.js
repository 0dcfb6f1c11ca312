// The plan as it will be, in metres: what is said of it is chosen, moved and taken out there, and more is drawn.
import { element } from "/static/api.js";
import { Drawing, path, viewOf } from "/static/drawing.js";
import { segmentsOf, snap } from "./snap.js";
import { canDrawSolids } from "./solid.js";

const STEP_M = 0.1, FAR_M = 1;
const SNAP_PX = 11, TOUCH_PX = 22; // a finger hides what it points at
const SNAP_M = 0.25; // in a view of all of a large plan 11 px are more; a line so near to a wall lies in it (`corrections.openings`)
const CLICK_PX = 4; // a pointer that moves less is clicked
const SQUARE = 0.97; // cosine: an edge that meets the dragged one nearly at a right angle goes on with it
const ALONG = 0.97; // cosine: a passage so nearly parallel to a place lies in the same wall (`corrections.openings`)
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const LAYERS = ["source", "strokes", "gone", "changed", "places", "marks", "sketch"];
const STROKES = "strokes"; // the layer of a drawing's own lines
const SHORTEST_M = 0.3; // of what may be a wall
const PLACES = "places"; // the layer of what may close and what the plan has no passage at
export const SOLID = "solid"; // the source in three dimensions, beside the plan
const AROUND = 0.5; // of a plan's longer side: what was not found of it yet lies within
const SAME_M = 0.01; // frames are rounded
const ASIDE_M = 0.15; // beside a line lies the room, where the line itself was taken for a wall
const LEAST_DOOR_M = 0.7, MOST_DOOR_M = 1.2; // of a door that a stroke across a wall stands for
const SEEN_PX = 48; // of what is asked about: as wide as one and a half of the rings around it
const WIDER_THAN = 8, LEAST_VIEW_M = 10; // what is seen around it
const OF_WHOLE = /^(guess|floors|changed|layer)/; // questions about the file
const WIDER = 1.05; // a source that is hardly larger than the plan needs no other view
const SAID = "said"; // the layer of what is said of the plan
const AT_FIRST = ["map", "section_1_1", PLACES, SAID];
const BESIDE_M = 0.6; // the first room within this of a place is the room beside it
const keep = { "vector-effect": "non-scaling-stroke" };
const RESIZED = 1.25; // what is said of a file has made the plan so much larger: it needs another view
const isLike = (one, other) => [0, 1].every((k) => {
  const ratio = (one[k + 2] - one[k]) / (other[k + 2] - other[k]);
  return ratio < RESIZED && ratio > 1 / RESIZED;
});
const isSame = (one, other) => one.every((value, i) => Math.abs(value - other[i]) < SAME_M);
const apart = ([a, b], [c, d]) => Math.hypot(a - c, b - d);

const readingOf = ({ source: { said, changed } }) => JSON.stringify([said, changed]); // with what is said of the file, the plan may have another size

// From the coordinates of a plan to those of another of its source: corrections and builds move the origin.
function moveBetween(from, to) {
  if (!from || !to) return (at) => at;
  const [[a, b, x], [c, d, y]] = to, share = a * d - b * c;
  return (at) => {
    const [u, v] = from.map(([i, j, k]) => i * at[0] + j * at[1] + k);
    return [(d * (u - x) - b * (v - y)) / share, (a * (v - y) - c * (u - x)) / share];
  };
}

function farFrom(points, at) {
  return Math.min(...points.map((from, i) => {
    const to = points[i + 1] ?? from, [dx, dy] = [to[0] - from[0], to[1] - from[1]], square = dx * dx + dy * dy || 1;
    const share = Math.min(1, Math.max(0, ((at[0] - from[0]) * dx + (at[1] - from[1]) * dy) / square));
    return apart(at, [from[0] + share * dx, from[1] + share * dy]);
  }));
}

const isInside = ([x, y], rings) => rings.reduce((inside, ring) => ring.reduce((found, [ax, ay], i) => {
  const [bx, by] = ring[(i + 1) % ring.length];
  return (ay > y) !== (by > y) && x < ((bx - ax) * (y - ay)) / (by - ay) + ax ? !found : found;
}, inside), false);

export class Sheet {
  // `hooks`: choose(number) when something that is said is chosen, move(number, points) when a point of it was moved.
  constructor(stage, hint, hooks) {
    Object.assign(this, { stage, hint, hooks, tool: null, points: [], cross: null, snapped: "", plan: null, drawing: null });
    Object.assign(this, { chosen: -1, held: -1, moved: [], edge: null, waiting: [], layers: {}, segments: [], strokes: [], source: null, on: new Set(AT_FIRST), asked: null, like: [], which: 0, looked: null, named: [], picks: false });
  }

  get wanted() { return this.tool?.word ?? ""; }

  show(plan) {
    const last = this.plan?.plan === plan.plan ? this.plan : null, before = last?.shape ?? null;
    if (!before) this.draw(null);
    if (!before || this.plan.seen !== plan.seen) { this.chosen = -1; this.held = -1; }
    if (this.plan?.plan !== plan.plan) { this.source = null; this.beyond = this.draws = false; }
    this.plan = plan;
    this.waiting = [];
    if (!plan.shape) { // a house without a plan, the source of which is not read yet
      this.drawing = null;
      this.stage.replaceChildren();
      return;
    }
    if (this.source) this.#showSource();
    this.#collect();
    const isFirst = before && !before.rooms.length && plan.shape.rooms.length > 0 && !this.draws; // the plan that was looked for
    if (before && !isFirst && (!plan.source.changed || isLike(before.bounds, plan.shape.bounds))) this.#renew(last);
    else this.#open(plan.shape);
    this.#underlay();
    this.#colour(before && plan.shape.rooms.length && readingOf(last) === readingOf(plan) ? last : null, plan);
    this.#paint();
  }

  // Shows what the plan has become, in the view of before: a search may move the origin.
  #renew(last) {
    const { drawing, plan } = this, [dx, dy] = moveBetween(last.frame, plan.frame)([0, 0]), [x, y, wide, high] = drawing.view;
    drawing.renew(plan.shape);
    this.#widen();
    if (Math.hypot(dx, dy) > SAME_M) drawing.look([x + dx, y - dy, wide, high]);
  }

  // What lies under the plan: pictures of the source, walls to snap to, places that may be doors; in metres of the plan.
  under(source) {
    this.source = source;
    this.#showSource();
    if (!this.drawing) return;
    this.#collect();
    this.#underlay();
    this.#widen();
    this.#paint();
  }

  // Without rooms there is nothing else to see.
  #showSource() {
    if (this.plan.shape?.rooms.length) return;
    const { layers: [first], layers, strokes } = this.source;
    if (first && !strokes.length && !layers.some(({ name }) => this.on.has(name))) this.on.add(first.name);
    this.on.add(STROKES);
  }

  // The widest view holds all of the source too: what the plan left out lies beside it.
  #widen() {
    const { layers = [], edges = [], strokes = [] } = this.source ?? {}, { drawing } = this, { view } = drawing, own = this.#whole;
    const corners = [...layers.flatMap(({ box: [a, b, c, d] }) => [[a, b], [c, d]]), ...edges.flat(), ...strokes.flatMap(({ points }) => points)];
    const all = viewOf(corners.reduce(([a, b, c, d], [x, y]) => [Math.min(a, x), Math.min(b, y), Math.max(c, x), Math.max(d, y)], this.plan.shape.bounds));
    this.beyond = Math.max(all[2] / own[2], all[3] / own[3]) > WIDER;
    drawing.home = this.beyond ? all : own; // the view stays: a point that was aimed at must not move
    if (isSame(view, drawing.home)) drawing.view = drawing.home;
  }

  // What can be switched on and off: a name, a title, and whether it is shown.
  get switches() {
    if (!this.source) return [];
    const places = this.source.places.length ? [{ name: PLACES, title: "Places for doors" }] : [];
    const strokes = this.source.strokes.length ? [{ name: STROKES, title: "Lines of the file" }] : [];
    const solid = this.source.is_solid && canDrawSolids ? [{ name: SOLID, title: "In three dimensions" }] : [];
    const said = this.plan.effects.length ? [{ name: SAID, title: "Corrections" }] : [];
    return [...this.source.layers, ...places, ...strokes, ...solid, ...said].map(({ name, title }) => ({ name, title, on: this.on.has(name) }));
  }

  // Whether the plan that is shown has this frame: the same source lies under it.
  isAt(frame) {
    if (!frame || !this.plan?.frame || !this.plan.shape) return false;
    const [x1, y1, x2, y2] = this.plan.shape.bounds, move = moveBetween(this.plan.frame, frame);
    return [[x1, y1], [x2, y2]].every((each) => apart(move(each), each) < SAME_M);
  }

  toggle(name) {
    if (!this.on.delete(name)) this.on.add(name);
    if (!this.drawing) return;
    this.#collect();
    this.#underlay();
    this.#paint();
  }

  #collect() {
    const edges = (this.source?.edges ?? []).flatMap((ring) => ring.map((from, i) => [from, ring[(i + 1) % ring.length]]));
    this.strokes = this.#straightPieces();
    this.segments = [...segmentsOf(this.plan.shape), ...edges, ...this.strokes.map(({ ends }) => ends)];
  }

  // The straight pieces of the drawing's lines that are shown, each with what the file calls it.
  #straightPieces() {
    if (!this.source || !this.on.has(STROKES)) return [];
    return this.source.strokes.flatMap(({ kind, points }) => points.slice(1).map((to, i) => ({ kind, ends: [points[i], to] })));
  }

  // Shows the place of a question, and all places that are about to be answered alike.
  ask(question, like, which) {
    const isNew = question?.key !== this.asked?.key || like.length > this.like.length;
    Object.assign(this, { asked: question, like, which });
    if (isNew && question && !this.draws && !question.key.startsWith("stroke")) this.#lookAt(like.length > 1 ? like : [question]);
    this.#paint();
  }

  // Moves the view to the place of a question that lies outside it, or that is too small to be seen in it. Where the view
  // is still that of the last question, all of the plan is tried first.
  #lookAt(asked) {
    if (!this.drawing) return;
    const home = this.#whole, isOwn = this.drawing.view === this.looked;
    if (isOwn) this.drawing.look(home);
    const { view } = this.drawing, [first] = asked, points = asked.flatMap(({ at, answers }) => [at, ...(answers[0]?.points ?? [])]);
    const [x1, y1, x2, y2] = [0, 1].map((k) => Math.min(...points.map((each) => each[k]))).concat([0, 1].map((k) => Math.max(...points.map((each) => each[k]))));
    const holds = ([left, top, w, h]) => x1 > left && x2 < left + w && -y2 > top && -y1 < top + h, isIn = holds(view);
    const long = Math.max(first.size ?? 0, Math.sqrt(first.area ?? 0), x2 - x1, y2 - y1);
    if (OF_WHOLE.test(first.key)) { this.drawing.look(home); return; }
    if (asked.length > 1) {
      const room = LEAST_VIEW_M / 2;
      if (!isIn) this.drawing.look(holds(home) ? home : [x1 - room, -y2 - room, x2 - x1 + 2 * room, y2 - y1 + 2 * room]);
      return;
    }
    if (isIn && long >= SEEN_PX * this.#metres) return;
    const wide = Math.min(Math.max(WIDER_THAN * long, LEAST_VIEW_M), Math.max(home[2], home[3])), by = wide / Math.max(home[2], home[3]);
    const [w, h] = by < 1 ? [wide, wide * Math.min(1, home[3] / home[2])] : [home[2], home[3]];
    this.looked = by < 1 || !holds(home) ? [(x1 + x2 - w) / 2, (-y1 - y2 - h) / 2, w, h] : home;
    this.drawing.look(this.looked);
  }

  // The view of all of the plan; where there is none, of the main part of the source.
  get #whole() { return viewOf(this.plan.shape.bounds); }

  // The whole plan; once more, all that the source has.
  #lookAtAll() {
    const { view, home } = this.drawing;
    this.drawing.look(isSame(view, this.#whole) ? home : this.#whole);
  }

  #underlay() {
    this.#drawStrokes();
    const layers = (this.source?.layers ?? []).filter(({ name }) => this.on.has(name));
    this.stage.classList.toggle("see-through", layers.length > 0);
    this.layers.source.replaceChildren(...layers.map(({ title, png, box: [a, b, c, d] }) => {
      return element("image", { href: `data:image/png;base64,${png}`, x: a, y: -d, width: c - a, height: d - b, preserveAspectRatio: "none", role: "img", "aria-label": title });
    }));
  }

  #drawStrokes() {
    const kinds = Map.groupBy ? Map.groupBy(this.strokes, ({ kind }) => kind) : new Map([["", this.strokes]]);
    this.layers.strokes.replaceChildren(...[...kinds.entries()].map(([kind, all]) => {
      const d = all.map(({ ends: [[a, b], [x, y]] }) => `M${a},${-b}L${x},${-y}`).join("");
      const found = element("path", { class: "stroke", d, ...keep });
      found.append(element("title"));
      found.lastChild.textContent = `${kind}; click a line to say whether it is a wall`;
      return found;
    }));
  }

  // The places where the plan has no passage.
  get #freePlaces() {
    if (!this.source || !this.on.has(PLACES)) return [];
    const middle = (points) => [0, 1].map((k) => points.reduce((sum, each) => sum + each[k], 0) / points.length);
    const way = ([[ax, ay], [bx, by]]) => [(bx - ax) / (apart([ax, ay], [bx, by]) || 1), (by - ay) / (apart([ax, ay], [bx, by]) || 1)];
    const runsAlong = (one, other) => Math.abs(way(one)[0] * way(other)[0] + way(one)[1] * way(other)[1]) > ALONG;
    const reach = ({ width, segment }, ends) => (runsAlong(segment, ends) ? Math.max(0.45, width / 2) : width / 2); // one round a corner is another
    return this.source.places.filter(({ ends }) => this.plan.shape.doors.every((door) => apart(middle(door.rings[0]), middle(ends)) > reach(door, ends)));
  }

  // Whether one of the rooms holds all of some points.
  isInOneRoom(points) { return this.plan.shape.rooms.some(({ rings }) => points.every((each) => isInside(each, rings))); }

  // What a place says when it is taken: a door between two rooms, an entrance of one, an opening within one.
  #wordOf({ kind, ends: [a, b] }) {
    const [x, y] = [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2], far = apart(a, b) || 1;
    if (this.plan.shape.rooms.some(({ rings }) => isInside([x, y], rings))) return kind === "door" ? "door" : "opening";
    const [nx, ny] = [-(b[1] - a[1]) / far, (b[0] - a[0]) / far], ways = Array.from({ length: BESIDE_M / STEP_M }, (_, i) => (i + 1) * STEP_M);
    const roomAt = (at) => this.plan.shape.rooms.findIndex(({ rings }) => isInside(at, rings));
    const [one, other] = [1, -1].map((side) => ways.map((way) => roomAt([x + side * way * nx, y + side * way * ny])).find((room) => room >= 0) ?? -1);
    if (one >= 0 && one === other) return "opening";
    return one >= 0 && other >= 0 ? "door" : "entrance";
  }

  #open(shape) {
    this.drawing = new Drawing(this.stage, shape);
    this.drawing.svg.id = "plan-drawing";
    for (const name of ["clearance", "reach", "grid", "frame", "way"]) this.drawing.show(name, false);
    for (const name of LAYERS) {
      this.layers[name] = element("g", { class: name });
      const before = name === "source" ? this.drawing.svg.firstChild : name === "gone" || name === "changed" ? this.drawing.layers.labels : null;
      this.drawing.svg.insertBefore(this.layers[name], before);
    }
    this.drawing.onlook = () => this.#paint();
    this.drawing.onhover = (point, event) => {
      if (this.tool && event.pointerType === "mouse") { this.cross = this.#snap(point, event); this.#paint(); }
    };
    this.drawing.onclick = (point, event) => this.#click(point, event);
    this.drawing.ongrab = (point, event) => this.#grab(point, event);
    this.drawing.ondrag = (point, event) => {
      if (this.edge) this.moved = this.#withEdgeAt(this.#snap(point, event, null));
      else this.moved[this.held] = this.#snap(point, event, this.#others());
      this.#paint();
    };
    this.drawing.ondrop = (point, event) => this.#drop(point, event);
  }

  // What is another than before the last answer, in colour, until the next one.
  #colour(before, after) {
    const key = ({ rings, label, kind }) => JSON.stringify([rings.map((ring) => ring.map((at) => at.map((value) => Math.round(value * 1000) + 0))), label ?? kind]);
    const parts = ({ shape }) => [...shape.rooms, ...shape.doors], move = before && moveBetween(before.frame, after.frame);
    const moved = (each) => ({ ...each, rings: each.rings.map((ring) => ring.map(move)) });
    const [old, now] = [before ? parts(before).map(moved) : [], parts(after)], [had, has] = [new Set(old.map(key)), new Set(now.map(key))];
    const gone = old.filter((each) => !has.has(key(each))), made = before ? now.filter((each) => !had.has(key(each))) : [];
    if (before && !gone.length && !made.length && before.seen === after.seen) return;
    const draw = (each, kind) => element("path", { class: kind, d: path(each.rings), "fill-rule": "evenodd", ...keep });
    this.layers.gone.replaceChildren(...gone.map((each) => draw(each, "was")));
    this.layers.changed.replaceChildren(...made.map((each) => draw(each, "is")));
  }

  // Takes the points of a word (`tool`), and hands them to `done`; null ends the drawing.
  draw(tool, done = () => {}) {
    Object.assign(this, { tool, points: [], done, snapped: "" });
    this.draws ||= tool !== null; // until a question is answered: who draws several things keeps the view
    this.stage.classList.toggle("drawn-on", tool !== null);
    if (tool && this.plan) {
      const [x1, y1, x2, y2] = this.plan.shape.bounds;
      this.cross ??= [(x1 + x2) / 2, (y1 + y2) / 2];
      this.chosen = -1;
      this.stage.scrollIntoView({ block: "nearest" });
      this.stage.focus({ preventScroll: true });
    } else this.cross = null;
    this.#paint();
  }

  // Whether the points that are set are enough for a word that takes any number of them.
  get canEnd() { return Boolean(this.tool?.more) && this.points.length >= this.tool.points; }

  end() {
    const { points, done } = this;
    this.draw(null);
    this.waiting.push(points);
    this.#paint();
    done(points);
  }

  choose(number) {
    this.chosen = number;
    this.held = -1;
    this.hooks.choose(number);
    this.#paint();
  }

  // Whether a key was for the drawing.
  key(event) {
    if (!this.tool) {
      if (event.key === "+" || event.key === "=") this.drawing?.zoom(1 / 1.3);
      else if (event.key === "-") this.drawing?.zoom(1.3);
      else if (event.key === "0") { if (this.drawing) this.#lookAtAll(); }
      else if (event.key === "Escape" && this.chosen >= 0) this.choose(-1);
      else return false;
      return true;
    }
    const move = ARROWS[event.key];
    if (move) {
      const far = event.shiftKey ? FAR_M : STEP_M;
      this.cross = this.cross.map((value, i) => value + far * move[i]);
      this.snapped = "";
      this.#paint();
    } else if (event.key === "Enter" || event.key === " ") this.#set(this.cross);
    else if (event.key === "Escape") this.draw(null);
    else if (event.key === "Backspace" && this.points.length) { this.points.pop(); this.#paint(); }
    else if (event.key.toLowerCase() === this.tool.key && this.canEnd) this.end();
    else return false;
    return true;
  }

  // The smallest part of the file whose bounds hold some points.
  partAt(points) {
    const size = ([a, b, c, d]) => (c - a) * (d - b), isIn = ([a, b, c, d]) => points.every(([x, y]) => x > a - ASIDE_M && x < c + ASIDE_M && y > b - ASIDE_M && y < d + ASIDE_M);
    return (this.source?.parts ?? []).filter(({ box }) => isIn(box)).sort((one, other) => size(one.box) - size(other.box))[0];
  }

  // Shows parts of the file, by their names; while `picks` is set, a click names one: of a drawing that of a line.
  showParts(names, picks) {
    Object.assign(this, { named: names, picks });
    this.#paint();
  }

  #click(point, event) {
    if (!this.tool) {
      const mark = this.#markAt(point, event), place = mark < 0 ? this.#placeAt(point, event) : null;
      const stroke = mark < 0 && !place ? this.#strokeAt(point, event) : null;
      const one = this.#likeAt(point, event);
      if (this.#gap && farFrom(this.#gap, point) <= this.#reach(event)) this.hooks.take("wall", this.#gap);
      else if (one) this.hooks.only(one.key);
      else if (stroke && this.picks) this.hooks.part(stroke.kind);
      else if (place) this.hooks.take(this.#wordOf(place), place.ends);
      else if (stroke) this.#askOf(stroke, point);
      else if (mark < 0 && this.picks && this.partAt([point])) this.hooks.part(this.partAt([point]).name);
      else this.choose(mark);
      return;
    }
    if (this.canEnd && apart(point, this.points[0]) <= this.#reach(event)) { this.end(); return; }
    this.cross = this.#snap(point, event);
    this.#set(this.cross);
  }

  #set(point) {
    this.points.push(point.map((value) => Math.round(value * 1000) / 1000));
    if (this.points.length < this.tool.points || this.tool.more) this.#paint();
    else this.end();
  }

  get #metres() { return 1 / (this.drawing.svg.getScreenCTM()?.a || 1); } // of a pixel

  #reach(event) { return (event.pointerType === "touch" ? TOUCH_PX : SNAP_PX) * this.#metres; }

  #snap(point, event, start = this.points.at(-1) ?? null) {
    this.snapped = "";
    if (event.altKey || (this.tool && !this.tool.snaps)) return point;
    const most = this.tool?.word === "distance" ? Infinity : SNAP_M; // the size of the file is what is to be said
    const found = snap(point, start, this.segments, Math.min(SNAP_PX * this.#metres, most));
    this.snapped = found.kind;
    return found.point;
  }

  // The marked place there, unless it is a line of the drawing: a click asks about that one anyway.
  #likeAt(point, event) {
    const near = this.like.filter(({ key }) => !key.startsWith("stroke")).map((each) => [farFrom([each.at], point), each]);
    const [far, found] = near.reduce((best, each) => (each[0] < best[0] ? each : best), [Infinity, null]);
    return far <= this.#reach(event) ? found : null;
  }

  #placeAt(point, event) {
    const near = this.#freePlaces.map((place) => [farFrom(place.ends, point), place]).sort((one, other) => one[0] - other[0]);
    return near.length && near[0][0] <= this.#reach(event) ? near[0][1] : null;
  }

  #strokeAt(point, event) {
    const near = this.strokes.filter(({ ends }) => apart(...ends) >= SHORTEST_M).map((stroke) => [farFrom(stroke.ends, point), stroke]);
    const [far, found] = near.reduce((best, each) => (each[0] < best[0] ? each : best), [Infinity, null]);
    return far <= this.#reach(event) ? found : null;
  }

  // The door that a line of the drawing stands for: across the line where it leads from one room to another, else along it.
  // Its middle lies beside the line, which was taken for a wall.
  doorAt([a, b]) {
    const far = apart(a, b), [nx, ny] = [(a[1] - b[1]) / far * ASIDE_M, (b[0] - a[0]) / far * ASIDE_M];
    const inRoom = (at) => this.plan.shape.rooms.findIndex(({ rings }) => isInside(at, rings));
    const roomAt = ([x, y]) => [[x, y], [x + nx, y + ny], [x - nx, y - ny]].map(inRoom).find((room) => room >= 0) ?? -1;
    if (roomAt(a) === roomAt(b)) return [a, b];
    let [low, high] = [0, 1]; // where it leaves the first room
    const on = (share) => [0, 1].map((k) => a[k] + share * (b[k] - a[k])), first = roomAt(a);
    for (let i = 0; i < 12; i++) {
      const middle = (low + high) / 2;
      if (roomAt(on(middle)) === first) low = middle; else high = middle;
    }
    const [x, y] = on(high).map((value, k) => value + [nx, ny][k] / 2), half = Math.min(Math.max(far, LEAST_DOOR_M), MOST_DOOR_M) / 2 / far, [dx, dy] = [b[0] - a[0], b[1] - a[1]];
    return [[x - dy * half, y + dx * half], [x + dy * half, y - dx * half]].map((at) => at.map((value) => Math.round(value * 1000) / 1000));
  }

  // A line first, then all others of its layer, the nearest to the point first; those of other plans of the sheet are not meant.
  #askOf({ kind, ends }, point) {
    const shortest = this.plan.shape.rooms.length ? SHORTEST_M : Math.min(SHORTEST_M, apart(...ends) / 20); // without a plan the size may be wrong
    const { rooms, bounds: [x1, y1, x2, y2] } = this.plan.shape, around = rooms.length ? AROUND * Math.max(x2 - x1, y2 - y1) : Infinity;
    const isNear = ([x, y]) => x > x1 - around && x < x2 + around && y > y1 - around && y < y2 + around;
    const like = this.strokes.filter((each) => each.kind === kind && each.ends[0] !== ends[0] && apart(...each.ends) >= shortest && each.ends.every(isNear));
    const near = like.map((each) => [farFrom(each.ends, point), each.ends]).sort((one, other) => one[0] - other[0]);
    this.hooks.stroke([ends, ...near.map(([, other]) => other)], kind);
  }

  // The gap by which a space is still open, if it is asked about.
  get #gap() { return this.asked?.key.startsWith("gap") ? this.asked.answers[0].points : null; }

  #markAt(point, event) {
    const all = (this.on.has(SAID) ? this.plan.effects : []).map(({ points }, i) => [farFrom(points, point), i]).sort((one, other) => one[0] - other[0]);
    return all.length && all[0][0] <= this.#reach(event) ? all[0][1] : -1;
  }

  // The edge of a room that is nearest to a point, if it is near enough to be dragged: its room's corners, and its number.
  #grabEdge(point, event) {
    const all = this.plan.shape.rooms.flatMap(({ rings: [ring] }) => ring.map((from, i) => ({ ring, i, far: farFrom([from, ring[(i + 1) % ring.length]], point) })));
    const nearest = all.reduce((best, each) => (best && best.far <= each.far ? best : each), null);
    this.edge = nearest && nearest.far <= this.#reach(event) ? { ...nearest, start: point } : null;
    this.moved = this.edge ? this.edge.ring : [];
    return Boolean(this.edge);
  }

  // The corners of a room whose edge was dragged to a point; edges at right angles to it become longer or shorter.
  #withEdgeAt([x, y]) {
    const { ring, i } = this.edge, [a, b] = [ring[i], ring[(i + 1) % ring.length]], long = apart(a, b);
    const across = [-(b[1] - a[1]) / long, (b[0] - a[0]) / long], far = (x - a[0]) * across[0] + (y - a[1]) * across[1];
    const moved = (at) => [at[0] + far * across[0], at[1] + far * across[1]];
    const goesOn = (at, from) => Math.abs((at[0] - from[0]) * across[0] + (at[1] - from[1]) * across[1]) > SQUARE * apart(at, from);
    const count = ring.length, before = ring[(i + count - 1) % count], after = ring[(i + 2) % count];
    return ring.flatMap((at, k) => {
      if (k === i) return goesOn(a, before) ? [moved(a)] : [a, moved(a)];
      if (k === (i + 1) % count) return goesOn(b, after) ? [moved(b)] : [moved(b), b];
      return [at];
    });
  }

  #grab(point, event) {
    if (this.tool?.word === "room_outline" && !this.points.length) return this.#grabEdge(point, event);
    if (this.tool || this.chosen < 0) return false;
    const { points } = this.plan.effects[this.chosen];
    this.held = points.findIndex((each) => apart(each, point) <= this.#reach(event));
    this.moved = points.map((each) => [...each]);
    return this.held >= 0;
  }

  // The point from which a moved end looks for right angles.
  #others() { return this.moved.length > 1 ? this.moved[this.held === 0 ? 1 : this.held - 1] : null; }

  #drop(point, event) {
    const { chosen, moved, held, edge } = this;
    this.held = -1;
    this.edge = null;
    if (edge && point) {
      if (apart(point, edge.start) <= CLICK_PX * this.#metres) this.#click(point, event);
      else {
        this.points = moved.map((each) => each.map((value) => Math.round(value * 1000) / 1000));
        this.end();
      }
      return;
    }
    if (point && held >= 0 && apart(moved[held], this.plan.effects[chosen].points[held]) > 1e-6) {
      this.waiting.push(moved);
      this.hooks.move(chosen, moved.map((each) => each.map((value) => Math.round(value * 1000) / 1000)));
    }
    this.#paint();
  }

  #paint() {
    if (!this.drawing) return;
    const unit = this.#metres, marks = [], sketch = [];
    const line = (points, kind, shut = false) => element("path", { class: kind, d: `M${points.map(([x, y]) => `${x},${-y}`).join(" ")}${shut ? "Z" : ""}`, ...keep });
    const dot = ([x, y], px, kind) => element("circle", { class: kind, cx: x, cy: -y, r: px * unit, ...keep });
    this.plan.effects.forEach(({ word, points, outcome, ghost }, i) => {
      if (!this.on.has(SAID) && i !== this.chosen) return;
      const kind = `mark ${ghost ? "ghost" : ""} ${word.startsWith("no_") ? "no" : ""} ${outcome === "none" ? "idle" : ""} ${i === this.chosen ? "chosen" : ""}`;
      const shown = i === this.chosen && this.held >= 0 ? this.moved : points;
      if (shown.length > 1) marks.push(line(shown, `${kind} line`, shown.length > 2));
      else marks.push(dot(shown[0], 9, kind));
      if (i === this.chosen) marks.push(...shown.map((each) => dot(each, 6, "handle")));
    });
    if (!this.tool) {
      for (const { at, answers } of this.like) {
        const { points } = answers[this.which];
        if (!this.asked.key.startsWith("stroke")) marks.push(dot(at, 12, "like-at"));
        if (points.length > 1) marks.push(line(points, "like", points.length > 2));
      }
      if (this.asked) marks.push(dot(this.asked.at, 16, "asked-at"));
      const answers = this.asked?.answers ?? [], { points = [], action, more = [] } = answers[0] ?? {};
      for (const each of [points, ...more]) if (each.length > 1 && action !== "one_room") marks.push(line(each, "like", each.length > 2));
      answers.forEach(({ points: [a, b, ...rest], action: other }, i) => { // what another answer draws elsewhere has its key
        if (!i || !b || rest.length || other === "one_room" || (points[0] && apart(a, points[0]) < 0.01)) return;
        marks.push(line([a, b], "like other"), element("text", { class: "key", x: (a[0] + b[0]) / 2, y: -(a[1] + b[1]) / 2, "font-size": 14 * unit }, String(i + 1)));
      });
      if (this.#gap) marks.push(line(this.#gap, "gap"));
    }
    for (const { name, box: [a, b, c, d] } of this.source?.parts ?? []) if (this.named.includes(name)) marks.push(line([[a, b], [c, b], [c, d], [a, d]], "named", true));
    for (const { kind, points } of this.source?.strokes ?? []) if (this.named.includes(kind)) marks.push(line(points, "named line"));
    for (const points of this.waiting) sketch.push(points.length > 1 ? line(points, "waiting", points.length > 2) : dot(points[0], 9, "waiting"));
    if (this.edge) sketch.push(line(this.moved, "cross", true));
    sketch.push(...this.points.map((each) => dot(each, 4, "point")));
    if (this.tool && this.cross) {
      const [x, y] = this.cross, arm = 14 * unit;
      if (this.points.length) sketch.push(line([...this.points, this.cross], "cross"));
      sketch.push(line([[x - arm, y], [x + arm, y]], "cross"), line([[x, y - arm], [x, y + arm]], "cross"));
      if (this.snapped) sketch.push(dot(this.cross, 7, "snapped"));
    }
    this.layers.places.replaceChildren(...this.#freePlaces.map(({ ends, kind }) => {
      const found = line(ends, "place");
      found.append(element("title"));
      found.lastChild.textContent = `${kind.replaceAll("_", " ")}; click to say what it is`;
      return found;
    }));
    this.layers.marks.replaceChildren(...marks);
    this.layers.sketch.replaceChildren(...sketch);
    this.hint.textContent = this.#words();
  }

  #words() {
    if (!this.tool || !this.cross) {
      if (this.chosen >= 0) return "Drag a point to move it. Delete takes the correction out. Escape ends.";
      return this.beyond && this.drawing.view !== this.drawing.home ? "The source reaches beyond this view: 0, once or twice, shows all of it." : "";
    }
    const [x, y] = this.cross, last = this.points.at(-1);
    const where = this.plan.frame.map(([a, b, c]) => (a * x + b * y + c).toFixed(2)).join(", "); // as overrides.toml has it
    const length = last ? `, ${apart(last, this.cross).toFixed(2)} m long` : "", at = this.snapped ? `, at ${this.snapped}` : "";
    const what = this.tool.points === 1 ? "a point in it" : this.tool.more ? `point ${this.points.length + 1}`
      : this.points.length ? "the other end" : "one end";
    const drags = this.tool.word === "room_outline" && !this.points.length ? " Or drag an edge of a room." : "";
    const ends = this.canEnd ? ` ${this.tool.key.toUpperCase()}, or the first point again, ends it.` : "";
    return `${this.tool.title}: set ${what}: click, or arrows (Shift: 1 m) and Enter.${drags}${ends} Alt: no snapping. Escape ends. [${where}] in the source${length}${at}`;
  }
}
