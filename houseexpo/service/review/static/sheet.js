// The picture of a plan with marks on it, and points set by mouse, touch or keyboard, in the plan's metres.
const STEP_M = 0.1;
const FAR_M = 1;
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const SVG = "http://www.w3.org/2000/svg";

export class Sheet {
  constructor(stage, picture, marks, hint) {
    Object.assign(this, { stage, picture, svg: marks, hint, wanted: "", points: [], cross: null, plan: null });
    marks.addEventListener("click", (event) => this.#click(event));
    marks.addEventListener("pointermove", (event) => {
      if (this.wanted && event.pointerType === "mouse") { this.cross = this.#metres(event); this.#paint(); }
    });
    new ResizeObserver(() => this.#lay()).observe(picture);
  }

  show(plan, address) {
    if (this.plan?.plan !== plan.plan) this.draw("");
    this.plan = plan;
    this.picture.src = address;
    this.picture.alt = `Plan ${plan.plan}`;
    const [wide, high] = plan.picture.size;
    this.picture.width = wide;
    this.picture.height = high;
    this.svg.setAttribute("viewBox", `0 0 ${wide} ${high}`);
    this.#lay();
    this.#paint();
  }

  // Takes the points of a word, as many as `asks` names, and hands them to `done`.
  draw(kind, done = () => {}, asks = ["a point in it"]) {
    Object.assign(this, { wanted: kind, points: [], done, asks });
    this.stage.classList.toggle("drawing", kind !== "");
    if (kind && this.plan) {
      const { origin, ppm, size } = this.plan.picture;
      this.cross ??= [origin[0] + size[0] / ppm / 2, origin[1] + size[1] / ppm / 2];
      this.stage.focus({ preventScroll: true });
    } else this.cross = null;
    this.#paint();
  }

  // Whether a key was for the drawing.
  key(event) {
    if (!this.wanted) return false;
    const move = ARROWS[event.key];
    if (move) {
      const far = event.shiftKey ? FAR_M : STEP_M;
      this.cross = this.cross.map((value, i) => value + far * move[i]);
      this.#paint();
    } else if (event.key === "Enter" || event.key === " ") this.#set(this.cross);
    else if (event.key === "Escape") this.draw("");
    else if (event.key === "Backspace" && this.points.length) { this.points.pop(); this.#paint(); }
    else return false;
    return true;
  }

  #click(event) {
    if (!this.wanted) return;
    this.cross = this.#metres(event);
    this.#set(this.cross);
  }

  #set(point) {
    this.points.push(point.map((value) => Math.round(value * 1000) / 1000));
    if (this.points.length < this.asks.length) return this.#paint();
    const { points, done } = this;
    this.draw("");
    done(points);
  }

  #metres(event) {
    const box = this.svg.getBoundingClientRect();
    const { origin, ppm, size } = this.plan.picture;
    const across = (event.clientX - box.left) / box.width * size[0];
    const down = (event.clientY - box.top) / box.height * size[1];
    return [origin[0] + across / ppm, origin[1] + (size[1] - down) / ppm];
  }

  #pixel([x, y]) {
    const { origin, ppm, size } = this.plan.picture;
    return [(x - origin[0]) * ppm, size[1] - (y - origin[1]) * ppm];
  }

  // The marks lie on the picture, wherever it stands in the stage.
  #lay() {
    const { offsetLeft: left, offsetTop: top, offsetWidth: wide, offsetHeight: high } = this.picture;
    Object.assign(this.svg.style, { left: `${left}px`, top: `${top}px`, width: `${wide}px`, height: `${high}px` });
  }

  #paint() {
    if (!this.plan) return;
    const parts = [];
    const line = (from, to, kind) => parts.push(this.#part("line", kind, { x1: from[0], y1: from[1], x2: to[0], y2: to[1] }));
    const dot = (place, radius, kind) => parts.push(this.#part("circle", kind, { cx: place[0], cy: place[1], r: radius }));
    for (const { word, points } of this.plan.marks) {
      const places = points.map((point) => this.#pixel(point));
      if (places.length > 1) {
        line(places[0], places[1], word === "one_room" ? "one-room" : "door");
        continue;
      }
      const [x, y] = places[0];
      dot([x, y], 12, "no-room");
      if (word.startsWith("no_")) line([x - 8, y - 8], [x + 8, y + 8], "no-room");
    }
    for (const point of this.points) dot(this.#pixel(point), 4, "point");
    if (this.wanted && this.cross) {
      const [x, y] = this.#pixel(this.cross);
      if (this.points.length) line(this.#pixel(this.points[0]), [x, y], "cross");
      line([x - 14, y], [x + 14, y], "cross");
      line([x, y - 14], [x, y + 14], "cross");
    }
    this.svg.replaceChildren(...parts);
    this.hint.textContent = this.#words();
  }

  #words() {
    if (!this.wanted || !this.cross) return "";
    const where = this.cross.map((value) => value.toFixed(2)).join(", ");
    return `Set ${this.asks[this.points.length]}: click, or arrows (Shift: 1 m) and Enter. Escape ends. (${where}) m`;
  }

  #part(kind, name, attributes) {
    const found = document.createElementNS(SVG, kind);
    found.setAttribute("class", name);
    for (const [key, value] of Object.entries(attributes)) found.setAttribute(key, value);
    return found;
  }
}
