// Thousands of plans in a page that holds only those in sight: tiles are placed where the scroll is.
import { ask, count, counted, element, rounded, say } from "./api.js";

const PAGE = 100, CAPTION = 40, LEAST = 168;

export class Grid {
  constructor(place, data) {
    Object.assign(this, { place, data, query: "", found: 0, current: 0, stop: null, pages: new Map(), tiles: new Map(), waiting: false });
    addEventListener("scroll", () => this.soon(), { passive: true });
    new ResizeObserver(() => { this.measure(); this.draw(); }).observe(place);
    place.addEventListener("keydown", (event) => this.moved(event));
    place.addEventListener("focusin", (event) => { const number = Number(event.target.dataset.number); if (!Number.isNaN(number)) this.rove(number); });
  }

  show(query, found) {
    if (query !== this.query) { this.query = query; this.pages.clear(); this.clear(); this.current = 0; }
    this.found = found;
    this.measure();
    this.draw();
  }

  clear() { for (const tile of this.tiles.values()) tile.remove(); this.tiles.clear(); }

  measure() {
    const wide = this.place.clientWidth;
    const least = wide < 520 ? 150 : LEAST;
    this.columns = Math.max(Math.floor(wide / least), 2);
    this.side = wide / this.columns;
    this.tall = this.side + CAPTION;
    this.place.style.height = `${Math.ceil(this.found / this.columns) * this.tall}px`;
  }

  soon() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.draw(); });
  }

  draw() {
    if (!this.columns) return;
    const top = -this.place.getBoundingClientRect().top;
    const first = Math.max(Math.floor(top / this.tall) - 2, 0) * this.columns;
    const last = Math.min((Math.ceil((top + innerHeight) / this.tall) + 2) * this.columns, this.found);
    for (const [number, tile] of this.tiles) {
      const gone = number >= this.found || ((number < first || number >= last) && !tile.contains(document.activeElement));
      if (gone) { tile.remove(); this.tiles.delete(number); }
    }
    for (let number = first; number < last; number++) this.put(number);
    for (let page = Math.floor(first / PAGE); page * PAGE < last; page++) this.load(page);
    const inSight = Math.min(Math.max(Math.ceil(top / this.tall), 0) * this.columns, this.found - 1);
    this.rove(this.current >= first && this.current < last ? this.current : inSight);
  }

  // The plans are one stop of the Tab key: the one that was reached last, or else the first in sight.
  rove(number) {
    const next = this.tiles.get(number)?.firstChild;
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
      tile = element("div", { class: "tile", role: "listitem" }, element("a", { class: "plan waiting", "data-number": number, tabindex: -1 }));
      this.tiles.set(number, tile);
      const after = [...this.place.children].find((each) => Number(each.firstChild.dataset.number) > number);
      this.place.insertBefore(tile, after ?? null); // who listens to the page hears the plans in their order
    }
    const row = Math.floor(number / this.columns), column = number % this.columns;
    Object.assign(tile.style, {
      left: `${column * this.side}px`, top: `${row * this.tall}px`, width: `${this.side - 6}px`, height: `${this.tall - 6}px` });
    const line = this.pages.get(Math.floor(number / PAGE))?.[number % PAGE];
    if (line && tile.firstChild.classList.contains("waiting")) this.fill(tile, line, number);
  }

  fill(tile, line, number) {
    const id = encodeURIComponent(line.id);
    const facts = [counted(line.rooms, "room"), rounded(line.area >= 10 ? Math.round(line.area) : line.area, "m²")];
    if (line.quality !== undefined) facts.push(`q ${line.quality.toFixed(2)}`);
    const sort = new URLSearchParams(this.query).get("sort")?.replace("-", "");
    if (sort && !["id", "rooms", "area", "quality"].includes(sort) && line[sort] !== undefined) facts.unshift(`${sort.replace("_", " ")} ${rounded(line[sort])}`); // first: what comes last may be cut off
    const link = tile.firstChild;
    link.href = `/${this.data}/plan/${id}${this.query ? `?${this.query}` : ""}`;
    link.classList.remove("waiting");
    link.replaceChildren(
      element("img", { src: `/api/${this.data}/plans/${id}/thumbnail.svg`, alt: "", width: 200, height: 200, decoding: "async" }),
      element("span", { class: "id" }, line.id), element("span", {}, facts.join(" · ")));
    tile.setAttribute("aria-posinset", number + 1);
    tile.setAttribute("aria-setsize", this.found);
  }

  async load(page) {
    if (this.pages.has(page)) return;
    this.pages.set(page, null);
    const query = this.query;
    try {
      const answer = await ask(`/api/${this.data}/plans?${query ? `${query}&` : ""}offset=${page * PAGE}&limit=${PAGE}`);
      if (query !== this.query) return;
      this.pages.set(page, answer.plans);
      this.soon();
    } catch (error) {
      this.pages.delete(page);
      if (query === this.query) say(`The plans could not be loaded: ${error.message}`);
    }
  }

  moved(event) { // from plan to plan, also beyond what is in sight
    const from = Number(document.activeElement?.dataset.number);
    if (Number.isNaN(from) || event.ctrlKey || event.metaKey || event.altKey) return;
    const page = Math.max(Math.floor((innerHeight - 160) / this.tall), 1) * this.columns;
    const step = {
      ArrowLeft: -1, ArrowRight: 1, ArrowUp: -this.columns, ArrowDown: this.columns, Home: -from, End: this.found - 1 - from,
      PageUp: -Math.min(page, from), PageDown: Math.min(page, this.found - 1 - from),
    }[event.key];
    const to = from + step;
    if (!step || to < 0 || to >= this.found) return;
    event.preventDefault();
    const target = Math.floor(to / this.columns) * this.tall + this.place.getBoundingClientRect().top;
    if (target < 120 || target + this.tall > innerHeight) scrollBy(0, target < 120 ? target - 140 : target + this.tall - innerHeight + 20);
    this.draw();
    this.tiles.get(to)?.firstChild.focus({ preventScroll: true });
  }
}

export const plansFound = (found, total) => (found === total ? counted(total, "plan") : `${count(found)} of ${counted(total, "plan")}`);
