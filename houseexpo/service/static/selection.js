// Plans that a person selected, and what is done with them: download. The browser keeps them for its tab.
import { counted, element, say } from "./api.js";

const FEW = 400, LONGEST = 12000; // ids in one address

export class Selection {
  constructor(data) {
    Object.assign(this, { data, key: `selected ${data}`, told: [], lists: new Map() });
    this.ids = new Set(JSON.parse(sessionStorage.getItem(this.key) ?? "[]"));
  }

  has(id) { return this.ids.has(id); }

  changed(tell) { this.told.push(tell); }

  put(ids, on = true) {
    for (const id of ids) { if (on) this.ids.add(id); else this.ids.delete(id); }
    try { sessionStorage.setItem(this.key, JSON.stringify([...this.ids])); } catch { /* too many to keep: this page knows them */ }
    for (const tell of this.told) tell();
  }

  clear() { this.put([...this.ids], false); }

  async inOrder(query) { // the ids of a view, in its order
    if (!this.lists.has(query)) {
      const answer = await fetch(`/api/${this.data}/ids.txt?${query}`);
      this.lists.set(query, (await answer.text()).split("\n").filter(Boolean));
    }
    return this.lists.get(query);
  }
}

// The bar below the plans. `view()` is the query on show.
export class SelectionBar {
  constructor(bar, selection, about, view) {
    Object.assign(this, { bar, selection, about, view });
    this.said = bar.querySelector("#selected");
    this.part = (name) => bar.querySelector(`[data-does="${name}"]`);
    this.part("clear").addEventListener("click", () => selection.clear());
    this.part("all").addEventListener("click", async () => selection.put(await selection.inOrder(view())));
    this.part("form").append(...Object.entries(about.formats).map(([name, what]) => element("option", { value: name }, `${name}: ${what}`)));
    this.part("download").addEventListener("click", () => this.download());
    this.part("ids").addEventListener("click", () => save(`${selection.data}-ids.txt`, [...selection.ids].map((id) => `${id}\n`).join("")));
    selection.changed(() => this.draw());
    this.draw();
  }

  draw() {
    const { size } = this.selection.ids;
    this.bar.hidden = size === 0;
    this.said.textContent = `${counted(size, "plan")} selected`;
    document.body.classList.toggle("selecting", size > 0);
  }

  download() {
    const ids = [...this.selection.ids].map(encodeURIComponent).join(",");
    if (this.selection.ids.size > FEW || ids.length > LONGEST) {
      say(`A download may have at most ${FEW} plans. Save the list of ids and run: houseexpo export … --ids ${this.selection.data}-ids.txt`);
      return;
    }
    say("");
    location.href = `/api/${this.selection.data}/export/${this.part("form").value}?ids=${ids}`;
  }
}

function save(name, text) {
  const link = element("a", { href: URL.createObjectURL(new Blob([text], { type: "text/plain" })), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
