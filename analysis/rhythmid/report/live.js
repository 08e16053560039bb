"use strict";
// Puts a plot that can be zoomed in the place of every drawing that brings its data along. The drawings stay for print.
(() => {
const { HEIGHT, build, make, move, reset, toggle } = livePlot;
const ZOOM = 0.7; // of the range that is left when one zooms in by key or button
const PAN = 0.2; // of the range, by which one moves
const CURSOR_STEP = 0.01; // of the width, by which an arrow key moves the cursor
const plots = new Set();

/** A plot in the place of the figure's drawing, made when it is first seen. */
function enliven(figure) {
  const chart = JSON.parse(figure.querySelector("script").textContent);
  const live = make("div", "live"), holder = make("div", "holder"), tools = make("div", "tools");
  const hidden = new Set();
  let plot = null;
  const act = (shift, factor) => () => plot && move(plot, chart, shift, factor);
  const actions = [["◂", "Move left", act(-PAN, 1)], ["▸", "Move right", act(PAN, 1)], ["−", "Zoom out", act(0, 1 / ZOOM)],
    ["+", "Zoom in", act(0, ZOOM)], ["⤢", "Show all", () => plot && reset(plot, chart)]];
  for (const [sign, name, action] of actions) {
    const button = make("button", "", sign);
    button.type = "button";
    button.title = name;
    button.setAttribute("aria-label", name);
    button.addEventListener("click", action);
    tools.append(button);
  }
  const bar = make("div", "bar");
  bar.append(make("span", "y-label", chart.y.label), tools);
  holder.tabIndex = 0;
  holder.setAttribute("role", "group");
  holder.setAttribute("aria-label", `${chart.alt} Arrow keys move the cursor, with Shift the range; plus, minus and 0 zoom.`);
  const said = make("p", "unseen");
  said.setAttribute("aria-live", "polite");
  const keys = { "+": act(0, ZOOM), "-": act(0, 1 / ZOOM), 0: () => plot && reset(plot, chart) };
  holder.addEventListener("keydown", (event) => {
    const sideways = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!plot || event.ctrlKey || event.metaKey || event.altKey || !(sideways || keys[event.key])) return;
    event.preventDefault();
    if (!sideways) keys[event.key]();
    else if (event.shiftKey) move(plot, chart, sideways * PAN, 1);
    else {
      const width = plot.over.clientWidth, left = plot.cursor.left >= 0 ? plot.cursor.left : width / 2;
      plot.setCursor({ left: Math.min(width, Math.max(0, left + sideways * CURSOR_STEP * width)), top: plot.over.clientHeight / 3 });
      said.textContent = [...plot.tip.children].map((row) => row.textContent).join("; ");
    }
  });
  for (const item of figure.querySelectorAll(".legend li")) {
    const button = make("button"), label = item.textContent;
    button.type = "button";
    button.append(...item.childNodes);
    button.setAttribute("aria-pressed", "true");
    button.addEventListener("click", () => {
      const show = !hidden.delete(label) ? (hidden.add(label), false) : true;
      button.setAttribute("aria-pressed", String(show));
      if (plot) toggle(plot, chart, label, show);
    });
    item.append(button);
  }
  live.append(bar, holder, said);
  figure.querySelector(":scope > svg").before(live);
  figure.classList.add("enlivened");
  new ResizeObserver(() => {
    if (!holder.clientWidth) return;
    if (!plot) {
      holder.plot = plot = build(chart, holder, hidden);
      plots.add(plot);
    } else if (plot.width !== holder.clientWidth) plot.setSize({ width: holder.clientWidth, height: HEIGHT });
  }).observe(holder);
}

for (const data of document.querySelectorAll("figure > script")) enliven(data.parentElement);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => plots.forEach((plot) => plot.redraw(false)));

const choice = document.querySelector(".drawings");
choice.hidden = false;
choice.addEventListener("click", () => {
  const still = document.documentElement.classList.toggle("still");
  choice.setAttribute("aria-pressed", String(still));
});
})();
