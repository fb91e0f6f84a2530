"use strict";
// The page of glint-bench --preset. `results` is the document that it writes.
const results = JSON.parse(document.getElementById("results").textContent);
const element = (id) => document.getElementById(id);

function node(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

const number = (x) => (x == null ? "" : x >= 1000 ? String(Math.round(x)) : String(Number(x.toPrecision(3))));
const ratio = (row) => (row.paper > 0 && row.ours > 0 ? row.ours / row.paper : null);
const figureOf = (row) => (row.unit ? `${row.figure}, ${row.unit}` : row.figure);

function drawRatios() {
  const rows = results.rows.filter((row) => ratio(row) != null).map((row, k) => ({ ...row, ratio: ratio(row), label: `${row.source}: ${row.subject}`, k }));
  element("charts").hidden = rows.length === 0;
  if (rows.length === 0) return;
  const labels = [...new Set(rows.map((row) => row.label))], width = element("charts").clientWidth;
  element("ratios").replaceChildren(
    Plot.legend({ color: { domain: [...new Set(rows.map((row) => row.figure))], scheme: "tableau10" }, style: { background: "transparent" } }),
    Plot.plot({
      width, height: 60 + 22 * labels.length, marginLeft: Math.min(380, 0.55 * width), marginRight: 20, style: { background: "transparent", fontSize: width < 700 ? "9px" : "12px" },
      color: { domain: [...new Set(rows.map((row) => row.figure))], scheme: "tableau10" },
      x: { type: "log", label: "ours over the paper's \u2192", grid: true, tickFormat: number }, y: { domain: labels, label: null },
      marks: [
        Plot.ruleX([1], { stroke: "currentColor", strokeDasharray: "3,3" }),
        Plot.dot(rows, { x: "ratio", y: "label", fill: "figure", r: 5 }),
        Plot.tip(rows, Plot.pointer({ x: "ratio", y: "label", fill: "var(--paper)", title: (row) => `${row.label}\n${figureOf(row)}: ${number(row.ours)}, paper ${number(row.paper)}` })),
      ],
    }));
}

function drawRows() {
  const head = node("tr", {}, ...["of the paper", "subject", "figure"].map((title) => node("th", {}, title)),
    ...["paper", "ours", "ours / paper"].map((title) => node("th", { class: "number" }, title)), node("th", {}, "note"));
  element("rows").replaceChildren(head, ...results.rows.map((row) => node("tr", {}, ...[row.source, row.subject, figureOf(row)].map((text) => node("td", {}, text)),
    ...[number(row.paper), number(row.ours), number(ratio(row))].map((text) => node("td", { class: "number" }, text)), node("td", {}, row.note ?? ""))));
}

element("title").textContent = results.paper;
element("about").textContent = `Tables and plots of the paper, repeated by ${results.generator} on maps of the same kind${results.quick ? ", a quarter as wide (--quick)" : ""}.`;
element("machine").textContent = `${results.machine.processor}, ${results.machine.cores} cores, ${results.machine.system}. Seed ${results.seed}.`;
drawRows();
drawRatios();
let width = element("charts").clientWidth;
addEventListener("resize", () => { if (element("charts").clientWidth !== width) { width = element("charts").clientWidth; drawRatios(); } });
