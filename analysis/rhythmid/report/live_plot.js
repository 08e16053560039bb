"use strict";
// Plots of a report's data by uPlot: they zoom, tell values, hide curves and follow one another. See live.js for their figures.
const livePlot = (() => {
const HEIGHT = 260; // px of a plot
const NARROWEST = 54; // px of an axis' numbers, so that plots below one another stand in line
const MISSING = 65535; // see live.py
const CURVE = 1.8, DOT = 7; // px
const BAND = "38"; // opacity of a band, in the notation of colours
const FONT = '12px system-ui, -apple-system, "Segoe UI", Roboto, "DejaVu Sans", sans-serif';
const linked = new Map(); // link -> plots that show the same range of x

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const make = (tag, className, text = "") => {
  const element = document.createElement(tag);
  element.className = className;
  element.textContent = text;
  return element;
};

// --- data ---------------------------------------------------------------------------------------------------------

const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

function grid(told) {
  if (told.count) return Array.from({ length: told.count }, (_, i) => told.first + i * told.step);
  const view = new DataView(bytes(told.float32).buffer);
  return Array.from({ length: view.byteLength / 4 }, (_, i) => told.first + view.getFloat32(4 * i, true));
}

function values(told) {
  const view = new DataView(bytes(told.uint16).buffer);
  return Array.from({ length: view.byteLength / 2 }, (_, i) => {
    const step = view.getUint16(2 * i, true);
    if (step === MISSING) return null;
    const value = told.low + told.step * step;
    return told.log ? 10 ** value : value;
  });
}

// --- numbers as the rest of the page has them ---------------------------------------------------------------------

const raised = (power) => String(power).replace(/./g, (c) => (c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[c]));

function number(value, digits = 4, scientific = false) {
  if (value === null || !Number.isFinite(value)) return "";
  if (value === 0) return "0";
  const power = Math.floor(Math.log10(Math.abs(value)));
  if (!scientific && power > -4 && power < Math.max(digits, 6)) {
    return String(Number(value.toFixed(Math.max(0, digits - 1 - power)))).replace("-", "−");
  }
  const factor = Number((value / 10 ** power).toFixed(digits - 1));
  return `${factor === 1 ? "" : `${String(factor).replace("-", "−")}·`}10${raised(power)}`;
}

const unitOf = (label) => (label.match(/\[([^\]]*)\]\s*$/) || ["", ""])[1];
const nameOf = (label) => label.replace(/\s*\[[^\]]*\]\s*$/, "");
const told = (value, unit) => number(value) + (unit ? `\u202f${unit}` : "");

// --- axes ---------------------------------------------------------------------------------------------------------

function decades(low, high) {
  const found = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power++) {
    for (const factor of high / low < 1e3 ? [1, 2, 5] : [1]) found.push(factor * 10 ** power);
  }
  const inside = found.filter((tick) => tick >= low * (1 - 1e-9) && tick <= high * (1 + 1e-9));
  const stride = Math.ceil(inside.length / 8);
  return inside.length > 1 ? inside.filter((_, i) => i % stride === 0) : [low, high];
}

function axis(about, scale, side) {
  const made = {
    scale, side, font: FONT, labelFont: FONT, labelGap: 2, labelSize: 22,
    stroke: () => colour("soft"),
    grid: { stroke: () => colour("grid"), width: 1 },
    ticks: { stroke: () => colour("measured"), width: 1, size: 4 },
    values: (plot, splits) => {
      // all ticks of a logarithmic axis are written alike
      const scientific = about.log && splits.some((tick) => tick >= 1e5 || tick < 1e-3);
      return splits.map((tick) => number(tick, 5, scientific));
    },
    gap: 4,
  };
  if (about.log) Object.assign(made, { splits: (plot, index, low, high) => decades(low, high), filter: (plot, splits) => splits });
  if (side === 2) return { ...made, label: about.label, size: 26, space: 60, grid: { show: false } };
  const widest = (plot, texts) => Math.max(...texts.map((text) => plot.ctx.measureText(text).width)) / devicePixelRatio;
  return { ...made, space: 36, size: (plot, texts) => {
    plot.ctx.font = FONT.replace("12px", `${12 * devicePixelRatio}px`);
    return texts ? Math.max(NARROWEST, Math.ceil(widest(plot, texts)) + 12) : NARROWEST;
  } };
}

function rangeOf(about, extras) {
  return (plot, low, high) => {
    if (low === null) return about.log ? [0.1, 1] : [0, 1];
    low = Math.min(low, ...extras);
    high = Math.max(high, ...extras);
    if (about.log) return [Math.max(low, 1e-7 * high) / 1.15, high * 1.15];
    if (about.zero) [low, high] = [Math.min(low, 0), Math.max(high, 0)];
    const air = high > low ? 0.05 * (high - low) : 0.5 * Math.abs(high || 1);
    return [about.zero && low === 0 ? 0 : low - air, about.zero && high === 0 ? 0 : high + air];
  };
}

// --- what is drawn beside the curves ------------------------------------------------------------------------------

function shade(plot, chart) {
  const { left, top, width, height } = plot.bbox;
  plot.ctx.save();
  plot.ctx.beginPath();
  plot.ctx.rect(left, top, width, height);
  plot.ctx.clip();
  plot.ctx.fillStyle = colour("shade");
  for (const [from, to] of chart.shaded) {
    const begin = plot.valToPos(from, "x", true);
    plot.ctx.fillRect(begin, top, Math.max(plot.valToPos(to, "x", true) - begin, 1), height);
  }
  plot.ctx.restore();
}

function rule(plot, chart) {
  const { ctx, bbox } = plot;
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  ctx.strokeStyle = colour("ink");
  ctx.lineWidth = devicePixelRatio;
  ctx.setLineDash([2 * devicePixelRatio, 3 * devicePixelRatio]);
  const line = (x0, y0, x1, y1) => { ctx.beginPath(); ctx.moveTo(x0, y0); ctx.lineTo(x1, y1); ctx.stroke(); };
  for (const value of chart.levels) {
    const y = plot.valToPos(value, "y", true);
    line(bbox.left, y, bbox.left + bbox.width, y);
  }
  for (const value of chart.uprights) {
    const x = plot.valToPos(value, "x", true);
    line(x, bbox.top, x, bbox.top + bbox.height);
  }
  ctx.restore();
}

/** An orbit: a line through its points in their order. */
function orbit(plot, index) {
  const path = new Path2D();
  uPlot.orient(plot, index, (series, xs, ys, scaleX, scaleY, toX, toY, left, top, width, height) => {
    xs.forEach((x, i) => {
      if (x === null || ys[i] === null) return;
      path.lineTo(toX(x, scaleX, width, left), toY(ys[i], scaleY, height, top));
    });
  });
  return { stroke: path, fill: null };
}

// --- ranges -------------------------------------------------------------------------------------------------------

function setRange(plot, scale, low, high) {
  if (high > low) plot.setScale(scale, { min: low, max: high });
}

/** Change the range of x (of both axes in an orbit): `shift` in parts of the range, `factor` of its size. */
function move(plot, chart, shift, factor) {
  plot.batch(() => {
    for (const scale of chart.path ? ["x", "y"] : ["x"]) {
      const { min, max } = plot.scales[scale];
      const [into, back] = chart[scale].log ? [Math.log10, (value) => 10 ** value] : [(v) => v, (v) => v];
      const half = (into(max) - into(min)) / 2, middle = (into(max) + into(min)) / 2 + (scale === "x" ? 2 * shift * half : 0);
      setRange(plot, scale, back(middle - factor * half), back(middle + factor * half));
    }
  });
}

function reset(plot, chart) {
  plot.batch(() => {
    setRange(plot, "x", ...chart.x.range);
    if (chart.path) setRange(plot, "y", ...chart.y.range);
  });
}

/** Charts with the same link follow one another. */
let following = false;
function follow(plot, chart, scale) {
  if (!chart.link || scale !== "x" || following) return;
  const { min, max } = plot.scales.x;
  following = true;
  for (const other of linked.get(chart.link)) {
    if (other !== plot && (other.scales.x.min !== min || other.scales.x.max !== max)) setRange(other, "x", min, max);
  }
  following = false;
}

// --- values under the cursor --------------------------------------------------------------------------------------

function nearest(plot, chart) {
  const { left, top } = plot.cursor;
  let best = null;
  chart.curves.forEach((curve, index) => {
    const series = plot.series[index + 1];
    if (!series.show) return;
    const [xs, ys] = plot.data[index + 1];
    xs.forEach((x, i) => {
      if (x === null || ys[i] === null) return;
      const distance = Math.hypot(plot.valToPos(x, "x") - left, plot.valToPos(ys[i], "y") - top);
      if (best === null || distance < best.distance) best = { distance, x, y: ys[i], curve };
    });
  });
  return best;
}

function readings(plot, chart) {
  if (chart.path) {
    const best = nearest(plot, chart);
    return best && [[null, best.curve.label], ["", `${nameOf(chart.x.label)} ${told(best.x, unitOf(chart.x.label))}`],
      ["", `${nameOf(chart.y.label)} ${told(best.y, unitOf(chart.y.label))}`]];
  }
  const index = plot.cursor.idx;
  if (index === null || index === undefined) return null;
  const rows = [[null, `${nameOf(chart.x.label)} ${told(plot.data[0][index], unitOf(chart.x.label))}`]];
  for (const [i, curve] of chart.curves.entries()) {
    const value = plot.data[curve.column][index];
    if (plot.series[curve.column].show && value !== null) {
      rows.push([curve.style, `${curve.label ? `${curve.label}: ` : ""}${told(value, unitOf(chart.y.label))}`]);
    }
  }
  return rows;
}

function tell(plot, chart) {
  const { left, top } = plot.cursor, tip = plot.tip;
  const rows = left >= 0 ? readings(plot, chart) : null;
  tip.hidden = !rows;
  if (!rows) return;
  tip.replaceChildren(...rows.map(([style, text]) => {
    const row = make("div", style === null ? "tip-title" : "", text);
    if (style) row.style.setProperty("--stroke", `var(--${style})`);
    if (style) row.className = "tip-curve";
    return row;
  }));
  const width = plot.over.clientWidth, height = plot.over.clientHeight;
  const right = left + 14 + tip.offsetWidth > width;
  tip.style.left = `${right ? Math.max(0, left - tip.offsetWidth - 14) : left + 14}px`;
  tip.style.top = `${Math.max(0, Math.min(top + 10, height - tip.offsetHeight))}px`;
}

// --- one figure ---------------------------------------------------------------------------------------------------

function tableOf(chart) {
  if (chart.path) return [null, ...chart.curves.map((curve) => [values(curve.x), values(curve.y)])];
  const table = [grid(chart.xs)];
  for (const curve of chart.curves) {
    curve.column = table.push(values(curve.y)) - 1;
    if (curve.low) curve.band = [table.push(values(curve.high)) - 1, table.push(values(curve.low)) - 1];
  }
  return table;
}

function seriesOf(chart) {
  const made = [{}];
  for (const curve of chart.curves) {
    const stroke = () => colour(curve.style);
    const facets = [{ scale: "x", auto: true }, { scale: "y", auto: true }];
    made.push({ label: curve.label, stroke, width: CURVE, dash: curve.dashed ? [6, 3] : undefined, spanGaps: false,
      points: { show: false }, ...(chart.path ? { facets, paths: orbit } : { scale: "y" }) });
    if (curve.band) for (let i = 0; i < 2; i++) made.push({ scale: "y", width: 0, points: { show: false } });
  }
  return made;
}

function bandsOf(chart) {
  const fill = (curve) => () => colour(curve.style) + BAND;
  return chart.curves.filter((curve) => curve.band).map((curve) => ({ series: curve.band, fill: fill(curve) }));
}

function optionsOf(chart, width) {
  const scale = (about, range) => ({ distr: about.log ? 3 : 1, time: false, range });
  const ends = (about) => (plot, low, high) => (low === null ? about.range : [low, high]);
  const pub = (event) => event === "mousemove" || event === "mouseleave";
  return {
    width, height: HEIGHT, mode: chart.path ? 2 : 1, legend: { show: false },
    scales: {
      x: scale(chart.x, ends(chart.x)),
      y: scale(chart.y, chart.path ? ends(chart.y) : rangeOf(chart.y, chart.levels)),
    },
    axes: [axis(chart.x, "x", 2), axis(chart.y, "y", 3)],
    series: seriesOf(chart), bands: chart.path ? [] : bandsOf(chart),
    cursor: {
      drag: { x: true, y: chart.path, dist: 6 }, points: { show: !chart.path, size: DOT },
      bind: { dblclick: (plot) => () => { reset(plot, chart); return null; } },
      ...(chart.path ? { dataIdx: () => null } : {}),
      ...(chart.link ? { sync: { key: chart.link, scales: ["x", null], filters: { pub } } } : {}),
    },
    hooks: {
      drawClear: [(plot) => shade(plot, chart)],
      draw: [(plot) => rule(plot, chart)],
      setScale: [(plot, scale) => follow(plot, chart, scale)],
      setCursor: [(plot) => plot.tip && tell(plot, chart)],
    },
  };
}

function build(chart, holder, hidden) {
  const table = tableOf(chart), plot = new uPlot(optionsOf(chart, holder.clientWidth), table, holder);
  plot.over.append((plot.tip = make("div", "tip")));
  plot.tip.hidden = true;
  if (chart.link) linked.set(chart.link, [...(linked.get(chart.link) || []), plot]);
  reset(plot, chart);
  const shown = (linked.get(chart.link) || []).find((other) => other !== plot);
  if (shown) setRange(plot, "x", shown.scales.x.min, shown.scales.x.max);
  for (const label of hidden) toggle(plot, chart, label, false);
  return plot;
}

function toggle(plot, chart, label, show) {
  chart.curves.forEach((curve, index) => {
    if (curve.label !== label) return;
    for (const column of [chart.path ? index + 1 : curve.column, ...(curve.band || [])]) plot.setSeries(column, { show });
  });
}

return { HEIGHT, build, make, move, reset, toggle };
})();
