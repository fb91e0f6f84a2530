"use strict";
// The page of glint-bench. `results` is the document that glint-bench writes.
const results = JSON.parse(document.getElementById("results").textContent);
const element = (id) => document.getElementById(id);
const hasPictures = results.maps.some((map) => map.pictures.length);
const state = { map: 0, shape: "round", size: null, metric: "seen", candidate: null, view: "method", subject: hasPictures ? "plane" : "ndf" };

const METRICS = {
  seen: "seen error", seen_worst: "seen error, worst half vector", bias: "bias, worst half vector", rel_l2: "relative L2 distance",
  tv: "total variation", energy: "energy too much or too little", ...(hasPictures && { rmse: "picture RMSE", flip: "FLIP of the picture" }),
};
const SHAPES = { round: "round", stretched: "stretched, 8 to 1", box: "square, turned" };
const SCENES = { plane: "lit plane", sphere: "lit sphere" };
const isOfPictures = (metric) => metric === "rmse" || metric === "flip";
const WITHIN = [0.01, 0.05, 0.1, 0.2];
const LARGEST = 10; // beyond 1000 % nothing is right
/** Least and largest error that charts show, which draw errors beyond there: a log axis has no 0. */
const errorDomain = () => (state.metric === "flip" ? [1e-4, 1] : [1e-3, LARGEST]);
/** FLIP of a black picture, the scale of the others; null where there is none. */
const blackFlip = (shape, size) => theMap().pictures.find((picture) => picture.scene === shape && picture.sigma_texels === size)?.black_flip ?? null;
const inChart = (error) => Math.min(errorDomain()[1], Math.max(errorDomain()[0], error));

// Measurements and figures

const theMap = () => results.maps[state.map];
const measurements = () => results.measurements.filter((measurement) => measurement.map === theMap().hash);
const measured = () => measurements().filter((measurement) => measurement.status === "ok");
const isTruth = (measurement) => measurement.errors.length === 0;
/** Errors of NDFs by shape of the footprint, and of pictures by scene. */
const setsOf = (measurement) => [...measurement.errors, ...measurement.pictures.map((picture) => ({ ...picture, shape: picture.scene }))];
const setOf = (measurement, shape, size) => setsOf(measurement).find((set) => set.shape === shape && set.sigma_texels === size);
const errorOf = (measurement, metric, shape, size) => {
  const error = setOf(measurement, shape, size)?.[metric];
  return error == null ? null : Math.abs(error);
};
/** Nanoseconds of a density of round footprints of a size. */
const timeAt = (measurement, size) => measurement.times.density.sizes.find((time) => time.sigma_texels === size)?.ns ?? measurement.times.density.cold.ns;
const COSTS = {
  time: { of: (measurement) => timeAt(measurement, state.size), label: "ns a density" },
  bytes: { of: (measurement) => measurement.file_bytes, label: "bytes" },
  prepare: { of: (measurement) => measurement.prepare.total_s, label: "seconds to prepare" },
};
function sizesOf(shape) {
  if (shape === "round") return theMap().truth.map((image) => image.sigma_texels);
  return [...new Set(measured().flatMap((measurement) => setsOf(measurement).filter((set) => set.shape === shape).map((set) => set.sigma_texels)))].sort((a, b) => a - b);
}

// Words

const percent = (x) => (x == null ? "" : x > LARGEST ? "> 1000 %" : x < 0.0005 ? "< 0.1 %" : `${(100 * x).toPrecision(x < 0.1 ? 2 : 3)} %`);
/** An error as text: FLIP has no unit, all others are relative. */
const errorText = (metric, x) => (metric === "flip" && x != null ? Number(x.toPrecision(2)).toString() : percent(x));
/** Three digits, without an exponent, in the largest of some units that gives at least 1: [[1e6, "MB"], [1e3, "kB"]]. */
function inUnits(x, units) {
  const [scale, unit] = units.find(([scale]) => x >= 0.9995 * scale) ?? units.at(-1);
  return `${Number((x / scale).toPrecision(3))} ${unit}`;
}
const bytesText = (x) => inUnits(x, [[1e9, "GB"], [1e6, "MB"], [1e3, "kB"]]);
const secondsText = (x) => inUnits(x, [[60, "min"], [1, "s"]]);
const nsText = (x) => inUnits(x, [[1e9, "s"], [1e6, "ms"], [1e3, "µs"], [1, "ns"]]);

function node(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

function fill(select, options, chosen) {
  select.replaceChildren(...options.map(([value, text]) => {
    const option = node("option", { value }, text);
    option.selected = String(value) === String(chosen);
    return option;
  }));
}

// Charts

/** Points that no other point beats in cost and in error, by cost. */
function paretoFront(points) {
  let least = Infinity;
  return [...points].sort((a, b) => a.cost - b.cost || a.shown - b.shown).filter((point) => {
    const better = point.shown < least;
    if (better) least = point.shown;
    return better;
  });
}

const methodColors = () => ({ domain: [...new Set(results.measurements.map((measurement) => measurement.method))], scheme: "tableau10" });
const chartWidth = () => Math.min(620, element("charts").clientWidth);
const tickText = (x) => (state.metric === "flip" ? String(+x.toPrecision(1)) : x >= 0.01 ? `${+(100 * x).toPrecision(2)} %` : `${+(100 * x).toPrecision(1)} %`);
const errorAxis = () => ({ type: "log", domain: errorDomain(), label: `↓ ${METRICS[state.metric]}`, tickFormat: tickText, grid: true });

function drawCost(id) {
  const { of, label } = COSTS[id];
  const points = measured().filter((measurement) => !isTruth(measurement)).map((measurement) => ({ measurement, cost: of(measurement), error: errorOf(measurement, state.metric, state.shape, state.size) }))
    .filter((point) => point.error != null && point.cost > 0).map((point) => ({ ...point, shown: inChart(point.error) }));
  const front = paretoFront(points);
  const truth = measured().filter((measurement) => isTruth(measurement) && of(measurement) > 0);
  const blacks = state.metric === "flip" ? [blackFlip(state.shape, state.size)].filter((flip) => flip > 0).map(inChart) : [];
  const asked = (point) => (setOf(point.measurement, state.shape, state.size).as_asked ? "" : "\nanswers a footprint of the same second moments");
  const chart = Plot.plot({
    width: chartWidth(), height: 340, marginLeft: 56, marginRight: 20, marginBottom: 42,
    style: { background: "transparent", fontSize: "12px" },
    color: methodColors(),
    x: { type: "log", label: `← ${label}`, grid: true, tickFormat: "~s", nice: true, insetLeft: 32 },
    y: errorAxis(),
    marks: [
      Plot.ruleX(truth, { x: of, stroke: "currentColor", strokeDasharray: "3,3", strokeOpacity: 0.6 }),
      Plot.text(truth, { x: of, frameAnchor: "top-right", text: () => "brute force", rotate: -90, dx: -8, dy: 4, textAnchor: "end", fillOpacity: 0.7 }),
      Plot.ruleY(blacks, { stroke: "currentColor", strokeDasharray: "3,3", strokeOpacity: 0.6 }),
      Plot.text(blacks, { y: (flip) => flip, frameAnchor: "right", text: () => "a black picture", textAnchor: "end", dx: -4, dy: -6, fillOpacity: 0.7 }),
      Plot.line(front, { x: "cost", y: "shown", stroke: "currentColor", strokeOpacity: 0.35, strokeWidth: 1.5 }),
      Plot.dot(points, { x: "cost", y: "shown", fill: (point) => point.measurement.method, r: 5, stroke: "var(--paper)" }),
      Plot.text(front, { x: "cost", y: "shown", text: (point) => point.measurement.setting, dy: -10, fontSize: 10, fillOpacity: 0.75 }),
      Plot.tip(points, Plot.pointer({ x: "cost", y: "shown", fill: "var(--paper)",
        title: (point) => `${point.measurement.name}\n${errorText(state.metric, point.error)} · ${nsText(COSTS.time.of(point.measurement))} · ${bytesText(point.measurement.file_bytes)} · ${secondsText(point.measurement.prepare.total_s)}\n${point.measurement.command}${asked(point)}` })),
    ],
  });
  element(id).replaceChildren(Plot.legend({ color: methodColors(), style: { background: "transparent" } }), chart);
}

function drawSizes() {
  const points = measured().flatMap((measurement) => setsOf(measurement).filter((set) => set.shape === state.shape && set[state.metric] != null)
    .map((set) => ({ measurement, size: set.sigma_texels, error: Math.abs(set[state.metric]), shown: inChart(Math.abs(set[state.metric])) })));
  const chart = Plot.plot({
    width: chartWidth(), height: 340, marginLeft: 56, marginRight: 20, marginBottom: 42,
    style: { background: "transparent", fontSize: "12px" },
    color: methodColors(),
    x: { type: "log", base: 2, label: "deviation of the footprint, texels →", tickFormat: "d", grid: true },
    y: errorAxis(),
    marks: [
      Plot.line(points, { x: "size", y: "shown", z: (point) => point.measurement.name, stroke: (point) => point.measurement.method }),
      Plot.dot(points, { x: "size", y: "shown", fill: (point) => point.measurement.method, r: 3 }),
      Plot.tip(points, Plot.pointer({ x: "size", y: "shown", fill: "var(--paper)", title: (point) => `${point.measurement.name}\n${errorText(state.metric, point.error)} at ${point.size} texels` })),
    ],
  });
  element("sizes").replaceChildren(Plot.legend({ color: methodColors(), style: { background: "transparent" } }), chart);
}

/** Adds the methods and their colours above a chart, which has them beside it on the page. */
function addLegend(chart, color) {
  const width = Number(chart.getAttribute("width")), height = Number(chart.getAttribute("height")), line = 16, letter = 6.5;
  let x = 6, row = 0;
  const legend = d3.create("svg:g").attr("font-size", 11).attr("fill", "currentColor").attr("text-anchor", "start");
  for (const method of color.domain) {
    const needed = 26 + letter * method.length;
    if (x + needed > width) { x = 6; row += 1; }
    legend.append("circle").attr("cx", x + 5).attr("cy", line * row).attr("r", 5).attr("fill", color.apply(method));
    legend.append("text").attr("x", x + 14).attr("y", line * row).attr("dy", "0.35em").text(method);
    x += needed;
  }
  const above = line * (row + 1) + 8;
  legend.attr("transform", `translate(0,${10 - above})`);
  chart.append(legend.node());
  chart.setAttribute("viewBox", `0 ${-above} ${width} ${height + above}`);
  chart.setAttribute("height", height + above);
}

/** A chart as an SVG document of its own, with colours instead of the page's variables. */
function svgText(id) {
  const chart = element(id).querySelector("figure > svg, :scope > svg:last-of-type");
  const copy = chart.cloneNode(true);
  addLegend(copy, chart.scale("color"));
  copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
  copy.style.background = "white";
  copy.style.color = "#24211b";
  return new XMLSerializer().serializeToString(copy).replaceAll("var(--paper)", "white");
}

function save(name, blob) {
  const link = node("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

function savePng(id) {
  const picture = new Image();
  picture.onload = () => {
    const canvas = node("canvas", { width: 2 * picture.width, height: 2 * picture.height });
    const context = canvas.getContext("2d");
    context.scale(2, 2);
    context.drawImage(picture, 0, 0);
    canvas.toBlob((blob) => save(`${id}.png`, blob));
  };
  picture.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svgText(id))}`;
}

// Tables

function drawCheapest() {
  // Errors of pictures where the reader chose them; else seen errors of round footprints, the measure that tolerances are given in.
  const [metric, shape] = isOfPictures(state.metric) ? [state.metric, state.shape] : ["seen", "round"];
  const within = (most) => (metric === "flip" ? `FLIP up to ${100 * most} % of black's` : `within ${100 * most} %`);
  const scaleOf = (size) => (metric === "flip" ? blackFlip(shape, size) ?? 1 : 1);
  element("cheapest-about").textContent = `${isOfPictures(metric) ? `${METRICS[metric]}, ${SCENES[shape]}` : "Seen error of round footprints"}, by size. ` +
    (metric === "flip" ? "FLIP is a mean over the whole picture, and a few glints fill little of it: so a black picture is the scale. " : "") +
    "The time is of a density of round footprints of this size, asked anywhere on the map.";
  const head = node("tr", {}, node("th", {}, "footprint"), ...WITHIN.map((most) => node("th", {}, within(most))));
  const rows = sizesOf(shape).map((size) => {
    const row = node("tr", size === state.size ? { class: "chosen" } : {}, node("th", {}, `${size} texels`));
    for (const most of WITHIN) {
      const able = measured().filter((measurement) => isTruth(measurement) || (errorOf(measurement, metric, shape, size) ?? Infinity) <= most * scaleOf(size));
      // One that is no more than a tenth quicker than a simpler one, which comes before it, counts as equal.
      const best = able.reduce((least, measurement) => (least == null || timeAt(measurement, size) < 0.9 * timeAt(least, size) ? measurement : least), null);
      row.append(best ? node("td", {}, best.name, node("br"), node("small", {}, `${nsText(timeAt(best, size))}, ${bytesText(best.file_bytes)}`)) : node("td", {}, "none"));
    }
    return row;
  });
  element("cheapest").replaceChildren(head, ...rows);
}

function drawFigures() {
  const columns = ["method", "prepare", "memory", "file", "density", "warm", "in a batch", "mean", "sample", `${METRICS[state.metric]}`, "command"];
  const head = node("tr", {}, ...columns.map((text, k) => node("th", k > 0 && k < 10 ? { class: "number" } : {}, text)));
  const rows = measurements().map((measurement) => {
    if (measurement.status !== "ok") return node("tr", {}, node("th", {}, measurement.name), node("td", { colspan: 10 }, measurement.message || measurement.status));
    const t = measurement.times;
    const figures = [secondsText(measurement.prepare.total_s), bytesText(measurement.prepare.peak_bytes), bytesText(measurement.file_bytes), nsText(t.density.cold.ns), nsText(t.density.warm.ns),
      nsText(t.density.batch.ns), nsText(t.mean.cold.ns), nsText(t.sample.cold.ns), isTruth(measurement) ? "the truth" : errorText(state.metric, errorOf(measurement, state.metric, state.shape, state.size))];
    return node("tr", {}, node("th", {}, measurement.name), ...figures.map((text) => node("td", { class: "number" }, text)), node("td", {}, node("code", {}, measurement.command)));
  });
  element("figures").replaceChildren(head, ...rows);
}

// Images

const decoded = new WeakMap();
/** Radiance of a lit picture: base64 of little-endian numbers of half precision, none below 0. */
function radianceOf(picture) {
  if (!decoded.has(picture)) {
    const bytes = atob(picture.picture);
    decoded.set(picture, Float32Array.from({ length: bytes.length / 2 }, (_, k) => {
      const half = bytes.charCodeAt(2 * k) | (bytes.charCodeAt(2 * k + 1) << 8), exponent = half >> 10, fraction = half & 1023;
      return exponent === 0 ? fraction * 2 ** -24 : (1 + fraction / 1024) * 2 ** (exponent - 15);
    }));
  }
  return decoded.get(picture);
}

/** The image of the chosen subject among those of a map or a measurement, of the size that is nearest to the chosen one: {size, pixels, up, values}. */
function imageOf(lists) {
  const isNdf = state.subject === "ndf";
  const images = isNdf ? lists.truth ?? lists.images : lists.pictures.filter((picture) => picture.scene === state.subject && picture.picture);
  const image = d3.least(images, (image) => Math.abs(Math.log2(image.sigma_texels / state.size)));
  if (!image) return null;
  const values = isNdf ? image.image : radianceOf(image);
  return { size: image.sigma_texels, pixels: Math.sqrt(values.length), rowsGoUp: isNdf, values, white: image.white ?? d3.max(values) };
}
const toSrgb = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);

/** Draws an image of a method, the truth, or their difference. */
function paint(canvas, { values: image }, { values: truth, pixels: all, rowsGoUp, white: brightest }, view, exposure, zoom) {
  const context = canvas.getContext("2d");
  const pixels = Math.max(2, Math.round(all / zoom));
  const first = (all - pixels) >> 1;
  const data = new ImageData(pixels, pixels);
  const white = brightest / 2 ** exposure;
  for (let j = 0; j < pixels; ++j) {
    for (let i = 0; i < pixels; ++i) {
      const row = rowsGoUp ? all - 1 - first - j : first + j;
      const from = row * all + first + i, to = 4 * (j * pixels + i);
      let color;
      if (view === "error") {
        const e = (image[from] - truth[from]) / white, bright = toSrgb(Math.min(1, Math.abs(e)));
        color = e > 0 ? [bright, 0.6 * bright, 0.1 * bright] : [0.15 * bright, 0.5 * bright, bright];
      } else {
        const value = toSrgb(Math.min(1, (view === "truth" ? truth[from] : image[from]) / white));
        color = [value, value, value];
      }
      data.data.set([...color.map((c) => Math.round(255 * c)), 255], to);
    }
  }
  const small = new OffscreenCanvas(pixels, pixels);
  small.getContext("2d").putImageData(data, 0, 0);
  context.imageSmoothingEnabled = false;
  context.clearRect(0, 0, canvas.width, canvas.height);
  context.drawImage(small, 0, 0, canvas.width, canvas.height);
}

const drawn = () => measured().filter((measurement) => !isTruth(measurement));
const chosenMeasurement = () => drawn().find((measurement) => measurement.name === state.candidate) || drawn()[0];

function drawPicture(view = state.view) {
  const measurement = chosenMeasurement(), truth = imageOf(theMap());
  const set = measurement && truth && setOf(measurement, state.subject === "ndf" ? "round" : state.subject, truth.size);
  const image = set && imageOf(measurement);
  if (image?.size !== truth?.size || !image) {
    element("picture").getContext("2d").clearRect(0, 0, element("picture").width, element("picture").height);
    element("caption").textContent = set?.given_up_s == null ? "Nothing was measured here." : `${measurement.name} is slow here: its picture was given up after ${secondsText(set.given_up_s)}.`;
    return;
  }
  paint(element("picture"), image, truth, view, Number(element("exposure").value), Number(element("zoom").value));
  const errors = state.subject === "ndf" ? `seen error ${percent(set.seen)}, relative L2 ${percent(set.rel_l2)} over ${set.places} places`
    : `FLIP ${errorText("flip", set.flip)} (a black picture ${errorText("flip", blackFlip(state.subject, truth.size))}), RMSE ${percent(set.rmse)}${set.as_asked ? "" : "; it answers boxes of the same second moments"}`;
  element("caption").textContent = `${view === "truth" ? "Truth" : measurement.name}: ${state.subject === "ndf" ? "footprint" : "footprint in the middle"} of ${truth.size} texels; ${errors}.`;
}

function drawStrip() {
  const truth = imageOf(theMap());
  const tile = (image, name, isPressed, act) => {
    const canvas = node("canvas", { width: 96, height: 96 });
    if (truth && image?.size === truth.size) paint(canvas, image, truth, "method", Number(element("exposure").value), Number(element("zoom").value));
    const button = node("button", { "aria-pressed": String(isPressed) }, canvas, name);
    button.addEventListener("click", act);
    return button;
  };
  const show = (view) => document.querySelector(`input[name=view][value=${view}]`).click();
  element("strip").replaceChildren(
    tile(truth, "truth", state.view === "truth", () => show("truth")),
    ...drawn().map((measurement) => tile(imageOf(measurement), measurement.name, state.view !== "truth" && measurement === chosenMeasurement(), () => {
      state.candidate = measurement.name;
      if (state.view === "truth") show("method");
      drawImages();
    })));
}

function drawImages() {
  fill(element("candidate"), drawn().map((measurement) => [measurement.name, measurement.name]), chosenMeasurement()?.name);
  drawPicture();
  drawStrip();
}

// The page

/** Shapes of the chosen error, and sizes of the chosen shape. */
function chooseShapeAndSize() {
  const shapes = isOfPictures(state.metric) ? SCENES : SHAPES;
  if (!Object.hasOwn(shapes, state.shape)) [state.shape] = Object.keys(shapes);
  fill(element("shape"), Object.entries(shapes), state.shape);
  const sizes = sizesOf(state.shape);
  const wanted = state.size ?? sizes[sizes.length >> 1];
  state.size = d3.least(sizes, (size) => Math.abs(Math.log2(size / wanted))) ?? null;
  fill(element("size"), sizes.map((size) => [size, `${size} texels`]), state.size);
}

function chooseSubject(subject) {
  state.subject = subject;
  element("subject").value = subject;
}

function draw() {
  chooseShapeAndSize();
  for (const id of Object.keys(COSTS)) drawCost(id);
  drawSizes();
  drawCheapest();
  drawFigures();
  drawImages();
}

/** Choices of the address, "report.html#metric=flip&shape=sphere&size=32&map=flakes"; "charts=all" keeps the charts for pipelines/bench_charts.py. */
function chooseFromAddress() {
  const asked = new URLSearchParams(location.hash.slice(1));
  const map = results.maps.findIndex((map) => map.name === asked.get("map"));
  if (map >= 0) state.map = map;
  if (Object.hasOwn(METRICS, asked.get("metric"))) state.metric = asked.get("metric");
  const shape = asked.get("shape");
  if (Object.hasOwn(SHAPES, shape) || Object.hasOwn(SCENES, shape)) state.shape = shape;
  if (Object.hasOwn(SCENES, shape) && hasPictures) chooseSubject(shape);
  if (Number(asked.get("size")) > 0) state.size = Number(asked.get("size"));
  element("map").value = state.map;
  element("metric").value = state.metric;
}

function start() {
  if (results.maps.length === 0) {
    element("about").textContent = "The results hold no map.";
    return;
  }
  const { machine } = results;
  element("about").textContent = `${results.measurements.length} measurements of ${results.maps.length} map${results.maps.length > 1 ? "s" : ""}, by ${results.generator}. ` +
    "Errors are against brute force over all texels.";
  element("machine").textContent = `${machine.processor}, ${machine.cores} cores, ${machine.system}; a plain microfacet lobe takes ${nsText(results.plain_lobe?.ns ?? NaN)} here. ` +
    `Seed ${results.seed}, ${results.places} places for each error. Densities are asked anywhere on the map, so that most miss the caches.`;
  fill(element("map"), results.maps.map((map, k) => [k, `${map.name} (${map.width} x ${map.height})`]), 0);
  fill(element("subject"), Object.entries({ ...(hasPictures && SCENES), ndf: "NDF of a round footprint" }), state.subject);
  fill(element("metric"), Object.entries(METRICS), state.metric);
  const on = (id, event, act) => element(id).addEventListener(event, (e) => act(e.target.value));
  on("map", "change", (value) => { state.map = Number(value); draw(); });
  on("shape", "change", (value) => { state.shape = value; if (value in SCENES) chooseSubject(value); draw(); });
  on("size", "change", (value) => { state.size = Number(value); draw(); });
  on("metric", "change", (value) => { state.metric = value; draw(); });
  on("subject", "change", (value) => { state.subject = value; drawImages(); });
  on("candidate", "change", (value) => { state.candidate = value; drawImages(); });
  on("exposure", "input", drawImages);
  on("zoom", "input", drawImages);
  for (const radio of document.querySelectorAll("input[name=view]"))
    radio.addEventListener("change", () => { state.view = radio.value; drawPicture(); drawStrip(); });
  const picture = element("picture");
  picture.addEventListener("pointerdown", () => drawPicture("truth"));
  for (const event of ["pointerup", "pointerleave"]) picture.addEventListener(event, () => drawPicture());
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.matches("select, input[type=range]")) return;
    const view = { 1: "truth", 2: "method", 3: "error" }[event.key], zoom = { "+": 1, "-": -1 }[event.key];
    if (view) document.querySelector(`input[name=view][value=${view}]`).click();
    if (zoom) { element("zoom").value = Number(element("zoom").value) + zoom; drawImages(); }
  });
  for (const button of document.querySelectorAll("[data-save]"))
    button.addEventListener("click", () => save(`${button.dataset.save}.svg`, new Blob([svgText(button.dataset.save)], { type: "image/svg+xml" })));
  for (const button of document.querySelectorAll("[data-save-png]")) button.addEventListener("click", () => savePng(button.dataset.savePng));
  let width = chartWidth();
  addEventListener("resize", () => { if (chartWidth() !== width) { width = chartWidth(); draw(); } });
  chooseFromAddress();
  draw();
  if (!location.hash.includes("charts=all")) return;
  const shown = { map: theMap().name, metric: state.metric, shape: state.shape, size: state.size };
  const offered = { map: results.maps.map((map) => map.name), metric: Object.keys(METRICS), shape: [...element("shape").options].map((option) => option.value), size: sizesOf(state.shape) };
  document.body.dataset.choices = JSON.stringify({ shown, offered });
  document.body.dataset.charts = JSON.stringify(Object.fromEntries([...Object.keys(COSTS), "sizes"].map((id) => [id, svgText(id)])));
}

start();
