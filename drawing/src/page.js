// Draws the figures of the page when they come near the screen, in the colours of the page, and keeps the time axes together.
"use strict";
const figures = JSON.parse(document.getElementById("figures").textContent);
const dark = matchMedia("(prefers-color-scheme: dark)");
const narrow = matchMedia("(max-width: 600px)");
const drawn = new Map();
let timeRange = null;
let following = false;

function colours() {
  const style = getComputedStyle(document.documentElement);
  const [text, grid] = [style.getPropertyValue("--text"), style.getPropertyValue("--line")];
  const axis = { gridcolor: grid, zerolinecolor: grid, linecolor: grid };
  return { text, axis };
}

function layoutOf({ figure, linked }) {
  const { text, axis } = colours();
  const layout = structuredClone(figure.layout);
  Object.assign(layout.xaxis, axis);
  Object.assign(layout.yaxis, axis);
  layout.xaxis.title.standoff = 6;
  if (linked && timeRange) layout.xaxis.range = timeRange;
  return Object.assign(layout, {
    font: { color: text, size: 12 },
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    margin: { l: narrow.matches ? 48 : 64, r: 12, t: 12, b: 40 },
    // Below the plot, where it takes no width on a phone.
    legend: { orientation: "h", y: narrow.matches ? -0.34 : -0.24, yanchor: "top" },
    dragmode: "zoom",
  });
}

function draw(place) {
  const shown = figures[place.id.replace("plot-", "")];
  const layout = layoutOf(shown);
  // Black lines would vanish on a dark page.
  const inText = (line) => (line.color === "#000000" ? { ...line, color: colours().text } : line);
  const data = shown.figure.data.map((trace) => (trace.line ? { ...trace, line: inText(trace.line) } : trace));
  const config = { responsive: true, displaylogo: false, displayModeBar: narrow.matches ? false : "hover" };
  Plotly.react(place, data, layout, config);
  if (!drawn.has(place)) {
    drawn.set(place, shown);
    if (shown.linked) place.on("plotly_relayout", (change) => follow(place, change));
  }
}

// Gives all time axes the range to which one of them was moved.
function follow(moved, change) {
  if (following) return;
  const from = change["xaxis.range[0]"];
  if (from === undefined && !change["xaxis.autorange"]) return;
  timeRange = from === undefined ? null : [from, change["xaxis.range[1]"]];
  const update = timeRange ? { "xaxis.range": timeRange } : { "xaxis.autorange": true };
  following = true;
  const others = [...drawn].filter(([place, shown]) => place !== moved && shown.linked);
  Promise.all(others.map(([place]) => Plotly.relayout(place, update))).finally(() => { following = false; });
}

const watch = new IntersectionObserver((entries) => {
  for (const entry of entries) {
    if (entry.isIntersecting && !drawn.has(entry.target)) draw(entry.target);
  }
}, { rootMargin: "600px" });
document.querySelectorAll(".plot").forEach((place) => watch.observe(place));
for (const media of [dark, narrow]) media.addEventListener("change", () => [...drawn.keys()].forEach(draw));
