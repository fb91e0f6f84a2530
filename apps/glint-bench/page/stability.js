"use strict";
// The page of glint-bench --stability. `results` is the document that it writes.
const results = JSON.parse(document.getElementById("results").textContent);
const element = (id) => document.getElementById(id);
const SMALLEST = 1e-3; // figures below are drawn there: a log axis has no 0
const state = { series: "" };

function node(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

const digits = (x) => (x >= 1000 ? String(Math.round(x)) : String(Number(x.toPrecision(3))));
const seriesOf = (test) => [...new Set(test.points.map((point) => point.series))];
const measured = (test) => test.points.filter((point) => point.value != null);
const isWanted = (series) => state.series === "" || series === state.series;
const allSeries = [...new Set(results.tests.flatMap(seriesOf))];

/** "holds", or the values of the axis at which a series does not hold. */
function verdict(test, series) {
  const points = test.points.filter((point) => point.series === series);
  const failed = points.filter((point) => point.value == null || point.value > test.tolerable).map((point) => digits(point.x));
  if (failed.length === 0) return "holds everywhere";
  return failed.length === points.length ? "holds nowhere" : `does not hold at ${failed.join(", ")}`;
}

function chartOf(test) {
  const points = measured(test).filter((point) => isWanted(point.series)).map((point) => ({ ...point, shown: Math.max(SMALLEST, point.value) }));
  const xs = test.points.map((point) => point.x);
  const isLog = Math.min(...xs) > 0 && Math.max(...xs) / Math.min(...xs) >= 8;
  return Plot.plot({
    width: Math.min(620, element("tests").clientWidth), height: 320, marginLeft: 56, marginRight: 20, marginBottom: 42,
    style: { background: "transparent", fontSize: "12px" },
    color: { domain: seriesOf(test), scheme: "tableau10" },
    x: { type: isLog ? "log" : "linear", label: `${test.axis} →`, grid: true, tickFormat: digits, ticks: isLog ? [...new Set(xs)] : undefined },
    y: { type: "log", label: `↑ ${test.figure}; lower is better`, grid: true, nice: true, tickFormat: digits },
    marks: [
      Plot.ruleY([test.tolerable], { stroke: "currentColor", strokeDasharray: "3,3", strokeOpacity: 0.7 }),
      Plot.text([test.tolerable], { y: (y) => y, frameAnchor: "right", text: () => "holds below", dy: 8, fillOpacity: 0.7 }),
      Plot.line(points, { x: "x", y: "shown", stroke: "series" }),
      Plot.dot(points, { x: "x", y: "shown", fill: "series", r: 3.5 }),
      Plot.tip(points, Plot.pointer({ x: "x", y: "shown", fill: "var(--paper)", title: (point) => `${point.series}\n${digits(point.value)} at ${digits(point.x)}` })),
    ],
  });
}

function sectionOf(test) {
  const color = { domain: seriesOf(test), scheme: "tableau10" };
  const rows = seriesOf(test).filter(isWanted).map((series) => node("tr", {}, node("th", {}, series), node("td", {}, verdict(test, series))));
  const failures = test.points.filter((point) => point.message && isWanted(point.series)).map((point) => node("li", {}, `${point.series} at ${digits(point.x)}: ${point.message}`));
  return node("section", { id: test.name }, node("h2", {}, test.title), node("p", {}, test.question), node("div", { class: "charts" },
    node("figure", {}, Plot.legend({ color, style: { background: "transparent" } }), chartOf(test)),
    node("div", { class: "wide" }, node("table", {}, ...rows), node("p", {}, test.instead), node("ul", {}, ...failures))));
}

const draw = () => element("tests").replaceChildren(...results.tests.map(sectionOf));

function start() {
  element("about").textContent = `${results.tests.length} tests by ${results.generator}, on maps of their own. Errors are against brute force over all texels. ` +
    "A method holds where its figure is below the dashed line.";
  element("machine").textContent = `Seed ${results.seed}${results.quick ? ", fewer and smaller tests (--quick)" : ""}. The figures do not depend on the machine.`;
  element("series").replaceChildren(node("option", { value: "" }, "all"), ...allSeries.map((series) => node("option", { value: series }, series)));
  element("series").addEventListener("change", (event) => { state.series = event.target.value; draw(); });
  let width = element("tests").clientWidth;
  addEventListener("resize", () => { if (element("tests").clientWidth !== width) { width = element("tests").clientWidth; draw(); } });
  draw();
}

start();
