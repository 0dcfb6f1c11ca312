// A histogram from which a range is drawn with the pointer, or typed in.
import { element, rounded } from "./api.js";

const WIDE = 260, TALL = 46;

export class Brush {
  constructor(measure, radii, changed) {
    this.measure = measure;
    this.changed = changed;
    this.range = [null, null];
    const typed = (side, words) => element("input", {
      type: "number", step: "any", "aria-label": `${measure.title}, ${words}`, placeholder: words,
      on: { change: (event) => this.type(side, read(event)) },
    });
    this.inputs = [typed(0, "from"), typed(1, "to")];
    this.radius = radii && element("select", { "aria-label": "Radius of the robot" },
      ...radii.map((radius) => element("option", { value: radius }, `r ${radius} m`)));
    this.radius?.addEventListener("change", () => changed(measure.name, this.range, this.radius.value));
    this.svg = element("svg", { class: "bars", viewBox: `0 0 ${WIDE} ${TALL}`, preserveAspectRatio: "none", role: "img" });
    this.title = element("h2", {}, measure.title + (measure.unit ? `, ${measure.unit}` : ""));
    this.node = element("div", { class: "measure", id: `measure-${measure.name}` },
      element("header", {}, this.title,
        element("span", { class: "ends" }, ...(this.radius ? [this.radius] : []), this.inputs[0], "–", this.inputs[1])),
      this.svg);
    this.node.hidden = true; // until there are bars: a view that is refused has none
    this.listen();
  }

  listen() {
    let start = null;
    const at = (event) => {
      const box = this.svg.getBoundingClientRect();
      const share = Math.min(Math.max((event.clientX - box.left) / box.width, 0), 1);
      return Math.min(Math.floor(share * this.bins.counts.length), this.bins.counts.length - 1);
    };
    this.svg.addEventListener("pointerdown", (event) => { start = at(event); this.svg.setPointerCapture(event.pointerId); });
    this.svg.addEventListener("pointermove", (event) => { if (start !== null) this.preview(start, at(event)); });
    this.svg.addEventListener("pointercancel", () => { start = null; this.draw(); });
    this.svg.addEventListener("pointerup", (event) => {
      if (start === null) return;
      const [one, other] = [start, at(event)].sort((a, b) => a - b);
      start = null;
      this.set(this.of(one, other));
    });
  }

  of(one, other) { // the bars from one to another, as a range; the last bar has no right end
    const { first, step, counts } = this.bins;
    const low = one === 0 ? null : tidy(first + one * step);
    const right = this.measure.counts ? first + (other + 1) * step - 1 : first + (other + 1) * step;
    return [low, other === counts.length - 1 ? null : tidy(right)];
  }

  preview(one, other) { [one, other] = [one, other].sort((a, b) => a - b); this.draw(this.of(one, other)); }

  type(side, end) { // the end that is typed counts: where the other one contradicts it, that one is open
    const range = this.range.with(side, end), [low, high] = range;
    this.set(low !== null && high !== null && low > high ? [null, null].with(side, end) : range);
  }

  set(range) { this.range = range; this.changed(this.measure.name, range, this.radius?.value); }

  show(bins, whole, range, radius) {
    Object.assign(this, { bins, whole, range: range ?? [null, null] });
    const known = whole.counts.reduce((sum, each) => sum + each, 0);
    this.node.hidden = whole.counts.length < 2 || known === 0;
    if (this.radius && radius) this.radius.value = radius;
    this.inputs.forEach((input, side) => { if (document.activeElement !== input) input.value = this.range[side] ?? ""; });
    if (!this.node.hidden) this.draw();
  }

  draw(range = this.range) {
    const { first, step, counts } = this.bins;
    const most = Math.max(...this.whole.counts, 1), now = Math.max(...counts, 1);
    const wide = WIDE / counts.length;
    const [low, high] = [range[0] ?? -Infinity, range[1] ?? Infinity];
    const bar = (value, i, cls, top) => element("rect", {
      class: cls, x: i * wide + 0.5, width: Math.max(wide - 1, 0.5), height: (value / top) * TALL, y: TALL - (value / top) * TALL });
    const inside = (i) => first + (i + 1) * step > low && first + i * step <= high;
    const bars = [
      ...this.whole.counts.map((value, i) => bar(value, i, "all", most)),
      ...counts.map((value, i) => bar(value, i, inside(i) ? "in" : "in out", Math.max(most * 0.02, now))),
    ];
    this.svg.replaceChildren(...bars);
    const from = rounded(first), to = rounded(first + counts.length * step);
    this.svg.setAttribute("aria-label", `${this.measure.title}: ${from} to ${to}, most plans ${rounded(first + counts.indexOf(now) * step)}`);
    counts.forEach((value, i) => this.svg.children[counts.length + i]?.append(element("title", {}, `${rounded(first + i * step)}: ${value}`)));
  }
}

const read = (event) => (event.target.value === "" ? null : Number(event.target.value));
const tidy = (value) => Number(value.toFixed(6));
