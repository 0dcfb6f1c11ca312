// Thousands of plans in a page that holds only those in sight: tiles, or lines of a table, are placed where the scroll is.
import { ask, count, counted, element, rounded, say } from "./api.js";

const PAGE = 100, CAPTION = 44, LEAST = 168, LINE = 44, GAP = 6;

export class Grid {
  constructor(place, head, data, selection) {
    Object.assign(this, { place, head, data, selection, query: "", found: 0, columns: [], table: false, current: 0, stop: null,
      pages: new Map(), tiles: new Map(), waiting: false });
    addEventListener("scroll", () => this.soon(), { passive: true });
    new ResizeObserver(() => { this.measure(); this.draw(); }).observe(place);
    place.addEventListener("keydown", (event) => this.pressed(event));
    place.addEventListener("focusin", (event) => { const number = numberOf(event.target); if (number !== null) this.rove(number); });
    place.addEventListener("click", (event) => this.clicked(event));
    selection.changed(() => this.mark());
  }

  // Columns are measures of the API: {name, title, unit}; without them the plans are tiles.
  show(query, found, columns) {
    const asked = `${query} ${columns?.map((each) => each.name) ?? ""}`;
    if (asked !== this.asked) { this.pages.clear(); this.clear(); this.current = query === this.query ? this.current : 0; }
    Object.assign(this, { asked, query, found, table: Boolean(columns), columns: columns ?? [] });
    this.place.classList.toggle("lines", this.table);
    this.place.setAttribute("role", this.table ? "rowgroup" : "list");
    this.measure();
    this.draw();
  }

  clear() { for (const tile of this.tiles.values()) tile.remove(); this.tiles.clear(); }

  measure() {
    const wide = this.place.clientWidth, least = wide < 520 ? 150 : LEAST;
    this.across = this.table ? 1 : Math.max(Math.floor(wide / least), 2);
    this.side = wide / this.across;
    this.tall = this.table ? LINE : this.side + CAPTION;
    this.place.style.height = `${Math.ceil(this.found / this.across) * this.tall}px`;
  }

  soon() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.draw(); });
  }

  draw() {
    if (!this.across) return;
    const top = -this.place.getBoundingClientRect().top;
    const first = Math.max(Math.floor(top / this.tall) - 2, 0) * this.across;
    const last = Math.min((Math.ceil((top + innerHeight) / this.tall) + 2) * this.across, this.found);
    for (const [number, tile] of this.tiles) {
      const gone = number >= this.found || ((number < first || number >= last) && !tile.contains(document.activeElement));
      if (gone) { tile.remove(); this.tiles.delete(number); }
    }
    for (let number = first; number < last; number++) this.put(number);
    for (let page = Math.floor(first / PAGE); page * PAGE < last; page++) this.load(page);
    const inSight = Math.min(Math.max(Math.ceil(top / this.tall), 0) * this.across, this.found - 1);
    this.rove(this.current >= first && this.current < last ? this.current : inSight);
  }

  // The plans are one stop of the Tab key: the one that was reached last, or else the first in sight.
  rove(number) {
    const next = this.tiles.get(number)?.link;
    if (!next) return;
    if (this.stop !== next) this.stop?.setAttribute("tabindex", -1);
    next.setAttribute("tabindex", 0);
    Object.assign(this, { current: number, stop: next });
  }

  focus() {
    this.draw();
    (this.stop?.isConnected ? this.stop : this.place).focus();
  }

  put(number) {
    let tile = this.tiles.get(number);
    if (!tile) {
      const link = element("a", { class: "plan waiting", "data-number": number, tabindex: -1 });
      tile = element("div", { class: "tile", role: this.table ? "row" : "listitem", "data-place": number },
        this.table ? element("span", { class: "cell first", role: "cell" }, link) : link);
      tile.link = link;
      this.tiles.set(number, tile);
      const after = [...this.place.children].find((each) => Number(each.dataset.place) > number);
      this.place.insertBefore(tile, after ?? null); // who listens to the page hears the plans in their order
    }
    const row = Math.floor(number / this.across), column = number % this.across, gap = this.table ? 0 : GAP;
    Object.assign(tile.style, {
      left: `${column * this.side}px`, top: `${row * this.tall}px`, width: `${this.side - gap}px`, height: `${this.tall - gap}px` });
    const line = this.pages.get(Math.floor(number / PAGE))?.[number % PAGE];
    if (line && tile.link.classList.contains("waiting")) this.fill(tile, line, number);
  }

  fill(tile, line, number) {
    const id = encodeURIComponent(line.id), { link } = tile;
    link.href = `/${this.data}/plan/${id}${location.search}`;
    link.classList.remove("waiting");
    const picture = element("img", { src: `/api/${this.data}/plans/${id}/thumbnail.svg`, alt: "", width: 200, height: 200, decoding: "async" });
    const facts = [element("span", { class: "id" }, line.id)], sort = new URLSearchParams(this.query).get("sort")?.replace("-", "");
    if (!this.table) {
      if (line.quality !== undefined) facts.unshift(`quality ${line.quality.toFixed(2)} · `);
      if (sort && !["id", "rooms", "area", "quality"].includes(sort) && line[sort] !== undefined) facts.unshift(`${sort.replace("_", " ")} ${rounded(line[sort])} · `);
    }
    link.replaceChildren(picture, element("span", { class: "name" }, line.title), element("span", { class: "facts" }, ...facts));
    const box = element("input", { type: "checkbox", class: "pick", tabindex: -1, "aria-label": `Select ${line.title}`, title: "Select (key: x)" });
    if (this.table) {
      tile.firstChild.prepend(box);
      tile.append(...this.columns.map(({ name, unit }) => cell(line[name], unit)));
    } else tile.append(box, );
    tile.plan = line.id;
    this.marked(tile);
    tile.setAttribute(this.table ? "aria-rowindex" : "aria-posinset", number + 1 + this.table);
    if (!this.table) tile.setAttribute("aria-setsize", this.found);
  }

  mark() { for (const tile of this.tiles.values()) this.marked(tile); }

  marked(tile) {
    const box = tile.querySelector(".pick"), chosen = tile.plan !== undefined && this.selection.has(tile.plan);
    tile.classList.toggle("chosen", chosen);
    if (box) box.checked = chosen;
  }

  async load(page) {
    if (this.pages.has(page)) return;
    this.pages.set(page, null);
    const { asked, query } = this, columns = this.columns.map((each) => each.name).join(",");
    try {
      const answer = await ask(`/api/${this.data}/plans?${query ? `${query}&` : ""}offset=${page * PAGE}&limit=${PAGE}${columns ? `&columns=${columns}` : ""}`);
      if (asked !== this.asked) return;
      this.pages.set(page, answer.plans);
      this.soon();
    } catch (error) {
      this.pages.delete(page);
      if (asked === this.asked) say(`The plans could not be loaded: ${error.message}`);
    }
  }

  // A click on the box selects one plan, and with Shift all from the last one; so do the keys x and Shift with arrows.
  clicked(event) {
    if (!event.target.matches(".pick")) return;
    const number = Number(event.target.closest(".tile").dataset.place), on = event.target.checked;
    if (event.shiftKey && this.anchor !== undefined) this.span(this.anchor, number, on);
    else this.selection.put([event.target.closest(".tile").plan], on);
    this.anchor = number;
  }

  async span(from, to, on = true) {
    const ids = await this.selection.inOrder(this.query), [first, last] = from < to ? [from, to] : [to, from];
    this.selection.put(ids.slice(first, last + 1), on);
  }

  pressed(event) { // from plan to plan, also beyond what is in sight
    const from = numberOf(document.activeElement);
    if (from === null || event.altKey) return;
    if (event.ctrlKey || event.metaKey) {
      if (event.key === "a") { event.preventDefault(); this.span(0, this.found - 1); }
      return;
    }
    const tile = this.tiles.get(from);
    if (event.key === "x" && tile?.plan !== undefined) { this.selection.put([tile.plan], !this.selection.has(tile.plan)); this.anchor = from; return; }
    if (event.key === "Escape") { this.selection.clear(); return; }
    const page = Math.max(Math.floor((innerHeight - 160) / this.tall), 1) * this.across;
    const step = {
      ArrowLeft: -1, ArrowRight: 1, ArrowUp: -this.across, ArrowDown: this.across, Home: -from, End: this.found - 1 - from,
      PageUp: -Math.min(page, from), PageDown: Math.min(page, this.found - 1 - from),
    }[event.key];
    const to = from + step;
    if (!step || to < 0 || to >= this.found) return;
    event.preventDefault();
    if (event.shiftKey) { this.anchor ??= from; this.span(this.anchor, to); } else this.anchor = undefined;
    const target = Math.floor(to / this.across) * this.tall + this.place.getBoundingClientRect().top;
    if (target < 150 || target + this.tall > innerHeight - 60) scrollBy(0, target < 150 ? target - 170 : target + this.tall - innerHeight + 80);
    this.draw();
    this.tiles.get(to)?.link.focus({ preventScroll: true });
  }
}

const numberOf = (node) => (node?.dataset?.number === undefined ? null : Number(node.dataset.number));

function cell(value, unit) {
  const words = value === undefined ? "–" : Array.isArray(value) ? value.join(", ").replaceAll("_", " ") : typeof value === "number" ? rounded(value, unit) : value;
  return element("span", { class: `cell${typeof value === "number" ? " number" : ""}`, role: "cell", title: Array.isArray(value) ? words : undefined }, words);
}

export const plansFound = (found, total) => (found === total ? counted(total, "plan") : `${count(found)} of ${counted(total, "plan")}`);
