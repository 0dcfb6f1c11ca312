// A plan as SVG in metres: x right, y up (so y is turned round), layers that can be shown and hidden, zoom and move.
import { element } from "./api.js";

export const path = (rings) => rings.map((ring) => `M${ring.map(([x, y]) => `${x},${-y}`).join(" ")}Z`).join("");
const line = { "vector-effect": "non-scaling-stroke" };
const FONT_PX = 11; // of the sizes beside the plan
const area = (cls, rings, more = {}) => element("path", { class: cls, d: path(rings), "fill-rule": "evenodd", ...line, ...more });

const marginOf = ([x1, y1, x2, y2]) => 0.06 * Math.max(x2 - x1, y2 - y1) + 0.2;

// The view of an area, with some room around it.
export function viewOf(bounds) {
  const [x1, y1, x2, y2] = bounds, margin = marginOf(bounds);
  return [x1 - margin, -y2 - margin, x2 - x1 + 2 * margin, y2 - y1 + 2 * margin];
}

export class Drawing {
  constructor(place, shape) {
    this.home = viewOf(shape.bounds);
    this.svg = element("svg", { role: "img", "aria-label": `Floor plan ${shape.id}`, preserveAspectRatio: "xMidYMid meet" });
    this.layers = {};
    for (const name of ["walls", "space", "boxes", "rooms", "objects", "clearance", "reach", "doors", "outline", "grid", "frame", "labels", "way"]) {
      this.layers[name] = element("g", { class: name });
      this.svg.append(this.layers[name]);
    }
    this.shape = shape;
    this.view = this.home;
    this.fill();
    place.replaceChildren(this.svg);
    this.look(this.home);
    this.listen();
  }

  // Shows another shape in the same place, as far as it was zoomed and moved.
  renew(shape) {
    this.shape = shape;
    for (const layer of Object.values(this.layers)) layer.replaceChildren();
    this.fill();
    this.letter();
  }

  fill() {
    const { shape, layers } = this, [x1, y1, x2, y2] = shape.bounds;
    layers.space.append(area("space", shape.space), area("open", shape.open));
    layers.outline.append(area("outline", shape.space));
    layers.walls.append(area("wall", shape.walls));
    layers.objects.append(...shape.objects.map((each) => titled(area("object", each.rings), `${each.label}, ${each.height} m high`)),
      ...(shape.stairs ?? []).map((points) => stroke("arc", points)));
    layers.boxes.append(element("clipPath", { id: "inside" }, element("path", { d: path(shape.space), "clip-rule": "evenodd" })));
    layers.boxes.setAttribute("clip-path", "url(#inside)");
    const boxes = [...shape.boxes].sort((a, b) => size(b.box) - size(a.box));
    layers.boxes.append(...boxes.map(({ label, colour, box: [a, b, c, d] }) =>
      titled(area("box", [[[a, b], [c, b], [c, d], [a, d]]], { fill: colour }), label.replaceAll("_", " "))));
    this.rooms(shape);
    for (let x = Math.ceil(x1); x <= x2; x++) layers.grid.append(rule(x, -y1, x, -y2, x % 5 === 0));
    for (let y = Math.ceil(y1); y <= y2; y++) layers.grid.append(rule(x1, -y, x2, -y, y % 5 === 0));
    const half = marginOf(shape.bounds) / 2, middle = -(y1 + y2) / 2;
    layers.frame.append(element("rect", { class: "size", x: x1, y: -y2, width: x2 - x1, height: y2 - y1, ...line }),
      word("measure", (x1 + x2) / 2, -y1 + half, `${(x2 - x1).toFixed(2)} m`),
      word("measure", x1 - half, middle, `${(y2 - y1).toFixed(2)} m`, { transform: `rotate(-90 ${x1 - half} ${middle})` }));
  }

  rooms({ rooms, doors, words, windows = [] }) {
    const { layers } = this;
    layers.rooms.replaceChildren(...rooms.map((room) =>
      titled(area(room.unsure ? "room unsure" : "room", room.rings, { fill: room.colour }), `${room.label}, ${room.area.toFixed(1)} m²${sure(room)}`)));
    layers.doors.replaceChildren(...doors.flatMap((door) => [
      titled(area(door.unsure ? "door unsure" : "door", door.rings, { fill: door.colour }), `${door.kind}, ${door.width.toFixed(2)} m${sure(door)}`),
      ...door.leaves.flatMap(({ leaf, arc }) => [stroke("leaf", leaf), stroke("arc", arc)])]),
      ...windows.map((each) => titled(area("window", each.rings), `window, ${each.width.toFixed(2)} m`)));
    this.words = words;
    this.letter();
  }

  show(name, on) { this.layers[name].style.display = on ? "" : "none"; if (name === "doors" || name === "rooms") this.layers.outline.style.display = ""; }

  clearance({ bounds: [a, b, c, d], png }) {
    this.layers.clearance.replaceChildren(element("image", {
      href: `data:image/png;base64,${png}`, x: a, y: -d, width: c - a, height: d - b, preserveAspectRatio: "none" }));
  }

  reach(found) {
    this.layers.reach.replaceChildren(...found.pieces.flatMap((piece, i) => [
      area(i === 0 ? "covers" : "lost", piece.covers), area("stands", piece.stands)]));
  }

  way(ends, points) {
    const radius = 0.008 * this.view[3];
    this.layers.way.replaceChildren(
      ...(points ? [element("polyline", { class: "way", points: points.map(([x, y]) => `${x},${-y}`).join(" "), ...line })] : []),
      ...ends.map(([x, y]) => element("circle", { class: "end", cx: x, cy: -y, r: radius, ...line })));
  }

  look(view) {
    this.view = view;
    this.svg.setAttribute("viewBox", view.map((each) => each.toFixed(4)).join(" "));
    this.letter();
    this.onlook?.();
  }

  letter() { // words keep their size on the screen, at the places that houseexpo/drawing gives them at the next lower scale
    const { clientWidth: wide, clientHeight: high } = this.svg, [, , across, up] = this.view;
    const metres = Math.max(across / (wide || 1), up / (high || 1)); // of a pixel
    this.layers.frame.style.fontSize = `${FONT_PX * metres}px`;
    const { texts } = this.words.findLast(({ scale }) => scale * metres <= 1) ?? { texts: [] };
    if (texts !== this.texts) this.layers.labels.replaceChildren(...texts.map(written));
    this.texts = texts;
    for (const [i, node] of [...this.layers.labels.children].entries()) node.style.fontSize = `${metres * letters(texts[i])}px`;
  }

  zoom(factor, [x, y] = [this.view[0] + this.view[2] / 2, this.view[1] + this.view[3] / 2]) {
    const wide = Math.min(Math.max(this.view[2] * factor, 0.5), this.home[2] * 4), by = wide / this.view[2];
    this.look([x - (x - this.view[0]) * by, y - (y - this.view[1]) * by, wide, this.view[3] * by]);
  }

  move(across, down) { // pixels of the screen
    const metres = 1 / this.svg.getScreenCTM().a, [x, y, wide, high] = this.view;
    this.look([x - across * metres, y - down * metres, wide, high]);
  }

  at(event) { // metres of the plan, y down as the SVG has it
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(this.svg.getScreenCTM().inverse());
    return [point.x, point.y];
  }

  listen() {
    const held = new Map(); // where each finger is, or the mouse while its button is down
    let moved = false, grabbed = null; // grabbed: the finger or button that moves something of the plan, not the plan
    new ResizeObserver(() => this.letter()).observe(this.svg);
    this.svg.addEventListener("wheel", (event) => { event.preventDefault(); this.zoom(event.deltaY > 0 ? 1.15 : 1 / 1.15, this.at(event)); }, { passive: false });
    this.svg.addEventListener("pointerdown", (event) => {
      moved = held.size > 0;
      held.set(event.pointerId, event);
      this.svg.setPointerCapture(event.pointerId);
      const [x, y] = this.at(event);
      if (!moved && this.ongrab?.([x, -y], event)) grabbed = event.pointerId;
    });
    this.svg.addEventListener("pointermove", (event) => {
      const [x, y] = this.at(event), before = held.get(event.pointerId);
      this.onhover?.([x, -y], event);
      if (grabbed === event.pointerId) { this.ondrag([x, -y], event); return; }
      if (!before || (!moved && apart(event, before) <= 4)) return;
      moved = true;
      held.set(event.pointerId, event);
      const other = [...held.values()].find((each) => each.pointerId !== event.pointerId);
      if (other) this.zoom(apart(before, other) / Math.max(apart(event, other), 1), this.at(other));
      else this.move(event.clientX - before.clientX, event.clientY - before.clientY);
    });
    this.svg.addEventListener("pointerup", (event) => {
      const click = held.delete(event.pointerId) && !moved, [x, y] = this.at(event);
      if (grabbed === event.pointerId) { grabbed = null; this.ondrop([x, -y], event); }
      else if (click) this.onclick?.([x, -y], event);
    });
    this.svg.addEventListener("pointercancel", (event) => {
      held.delete(event.pointerId);
      if (grabbed === event.pointerId) { grabbed = null; this.ondrop(null, event); }
    });
  }
}

const sure = ({ confidence }) => confidence === null ? "" : `, ${Math.round(100 * confidence)}% sure`;
const apart = (one, other) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY);
const size = ([a, b, c, d]) => (c - a) * (d - b);
const stroke = (cls, points) => element("polyline", { class: cls, points: points.map(([x, y]) => `${x},${-y}`).join(" "), ...line });
const rule = (x1, y1, x2, y2, five) => element("line", { x1, y1, x2, y2, class: five ? "five" : "", ...line });
const word = (cls, x, y, text, more = {}) => element("text", { class: cls, x, y, ...more }, text);
const titled = (node, text) => { node.append(Object.assign(document.createElementNS("http://www.w3.org/2000/svg", "title"), { textContent: text })); return node; };

const pen = document.createElement("canvas").getContext("2d");
pen.font = `100px ${getComputedStyle(document.body).fontFamily}`;
const ems = (text) => pen.measureText(text).width / 100;

// The size of letters, pixels, in which text is as wide as in the font that it was measured in.
const letters = ({ lines, size, wide }) => Math.min(size, wide / Math.max(...lines.map(ems)));

const written = ({ at: [x, y], lines, turned }) => element("g", turned ? { transform: `rotate(-90 ${x} ${-y})` } : {},
  ...lines.map((each, i) => word("in-room", x, -y, each, { dy: `${1.2 * (i - (lines.length - 1) / 2)}em` })));
