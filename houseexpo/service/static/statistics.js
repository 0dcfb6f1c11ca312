// Histograms of the plans that the filter finds.
import { ask, count, element, rounded, say } from "./api.js";

const place = document.getElementById("statistics"), { name, query } = place.dataset;
const WIDE = 320, TALL = 110;

function figure(measure) {
  if (!measure.known) return null;
  const { counts, first, step } = measure, sum = total(counts);
  const shares = counts.map((each) => each / sum);
  const most = Math.max(...shares, 1e-9), wide = WIDE / counts.length, up = (share) => TALL - (share / most) * TALL;
  const alone = measure.min === measure.max;
  if (alone) return element("section", { class: "card figure" }, element("h2", {}, measure.title), element("p", {}, `${rounded(measure.min, measure.unit)} in all ${count(total(counts))} plans that state it.`));
  const svg = element("svg", { viewBox: `0 0 ${WIDE} ${TALL + 18}`, role: "img", "aria-label": `${measure.title}: mean ${rounded(measure.mean, measure.unit)}` },
    ...shares.map((share, i) => titled(element("rect", { class: "one", x: i * wide + 0.5, width: Math.max(wide - 1, 0.5), y: up(share), height: TALL - up(share) }),
      `${rounded(first + i * step)}: ${count(counts[i])} plans, ${(100 * share).toFixed(1)}%`)),
    element("line", { class: "base", x1: 0, x2: WIDE, y1: TALL, y2: TALL }));
  svg.append(...axis(measure).map(([place, anchor, words]) => element("text", { x: place * wide, y: TALL + 14, "text-anchor": anchor }, words)));
  const rows = [["mean", "mean"], ["median", "median"], ["5% to 95%", "p05", "p95"], ["least to most", "min", "max"]];
  const table = element("table", {}, element("tbody", {}, ...rows.map(([words, ...keys]) =>
    element("tr", {}, element("th", { scope: "row" }, words), element("td", { class: "number" }, keys.map((key) => rounded(measure[key])).join(" to "))))));
  return element("section", { class: "card figure" }, element("h2", {}, measure.title + (measure.unit ? `, ${measure.unit}` : "")), svg, table);
}

// What stands below the bars: place (in bars), anchor, words. Bars of single numbers are named, of others their ends.
function axis({ counts, first, step, whole, min, max }) {
  const last = counts.length - 1;
  const more = (value) => `${rounded(value)}${max > value + 1e-6 ? "+" : ""}`; // the last bar takes all that is greater
  if (last === 0) return [[0.5, "middle", rounded(min)]];
  if (whole && step === 1) return [[0.5, "middle", rounded(first)], [last + 0.5, "middle", more(first + last)]];
  const end = first + (last + 1) * step;
  return [[0, "start", rounded(first)], [(last + 1) / 2, "middle", rounded((first + end) / 2)], [last + 1, "end", more(end)]];
}

function labels(found) {
  const names = Object.keys(found.labels).filter((label) => found.labels[label]).sort((a, b) => found.labels[b] - found.labels[a]);
  if (!names.length) return null;
  const most = Math.max(...Object.values(found.labels), 1e-9);
  const bar = (share) => (share / most) * 150;
  const svg = element("svg", { viewBox: `0 0 ${WIDE} ${names.length * 17}`, role: "img", "aria-label": "Labels by frequency" },
    ...names.flatMap((label, i) => [
      element("text", { class: "name", x: 116, y: i * 17 + 12, "text-anchor": "end" }, label.replaceAll("_", " ")),
      titled(element("rect", { class: "one", x: 122, y: i * 17 + 3, width: bar(found.labels[label]), height: 11 }), `${(100 * found.labels[label]).toFixed(1)}%`),
      element("text", { x: 126 + bar(found.labels[label]), y: i * 17 + 12 }, `${(100 * found.labels[label]).toFixed(1)}%`)]));
  return element("section", { class: "card figure tall" }, element("h2", {}, "Labels"), svg);
}

const total = (counts) => Math.max(counts.reduce((sum, each) => sum + each, 0), 1);
const titled = (node, text) => { node.append(Object.assign(document.createElementNS("http://www.w3.org/2000/svg", "title"), { textContent: text })); return node; };

ask(`/api/${name}/statistics?${new URLSearchParams(query)}`).then((found) => {
  const what = document.getElementById("what");
  what.textContent = `${found.found === found.total ? "All" : `${count(found.found)} of`} ${count(found.total)} plans. `;
  if (query) what.append(element("code", {}, decodeURIComponent(query)));
  if (!found.found) what.append(element("br"), found.total ? "No plan meets this filter." : "The data set has no plans.");
  const [first, ...others] = Object.values(found.measures).map(figure);
  document.getElementById("figures").append(...[first, labels(found), ...others].filter(Boolean));
}).catch((error) => say(error.message));
