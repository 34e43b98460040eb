// Charts by uPlot in the colours of the page, with labels as people read durations.

import { color, h } from "./dom.js";
import { duration } from "./labels.js";
import { NEAR_MARK, nearestMark } from "./marks.js";
import { downloads } from "./download.js";

const drawn = new Set();

// Series: {label, color, values, width, points, fill, paths, stepped, isJoined (over
// what is missing)}; x: numbers.
// Options: height, xFormat, yFormat, title, onClick(index), xLabel, yLabel, legend (false: none),
// xAxis (more of what uPlot takes for the axis), xName (of the first column of its CSV), marks (of
// an axis of time: what happened, or a promise of it).
export function chart(x, series, options = {}) {
  const frame = h("div", {
    className: "chart",
    role: "img",
    "aria-label": options.title ?? "chart",
  });
  const place = { frame, plot: null, marks: [] };
  const said = h("div", { className: "chart-said soft", role: "status" });
  Promise.resolve(options.marks ?? []).then((marks) => {
    place.marks = marks;
    place.plot?.redraw(false);
  });
  const draw = () => {
    place.plot?.destroy();
    frame.replaceChildren();
    const width = Math.max(frame.clientWidth || frame.parentElement?.clientWidth || 600, 240);
    const axis = (format, label, size, more) => ({
      stroke: color("soft"),
      grid: { stroke: color("line"), width: 1 },
      ticks: { stroke: color("line") },
      values: (_, splits) => splits.map((value) => format(value)),
      label,
      labelSize: label ? 22 : 0,
      labelFont: "12px system-ui, sans-serif",
      font: "11px system-ui, sans-serif",
      size,
      ...more,
    });
    place.plot = new globalThis.uPlot(
      {
        width,
        height: options.height ?? 240,
        legend: { show: options.legend ?? series.length > 1, live: false },
        cursor: { points: { show: Boolean(options.onClick) }, drag: { x: true, y: false } },
        scales: {
          x: { time: false },
          y: { range: (_, low, high) => [Math.min(0, low ?? 0), (high ?? 1) * 1.05 || 1] },
        },
        axes: [
          axis(options.xFormat ?? String, options.xLabel, 44, options.xAxis),
          axis(options.yFormat ?? duration, options.yLabel, 74),
        ],
        hooks: { draw: [(plot) => drawMarks(plot, place.marks)] },
        series: [
          {},
          ...series.map((one) => ({
            label: one.label,
            stroke: color(one.color),
            width: one.width ?? 1.5,
            spanGaps: Boolean(one.isJoined),
            fill: one.fill ? alpha(color(one.color), 0.35) : undefined,
            points: {
              show: Boolean(one.points),
              size: 5,
              fill: color(one.color),
              stroke: color(one.color),
            },
            paths: one.points
              ? () => null
              : one.bars
              ? globalThis.uPlot.paths.bars({ size: [1, Infinity], align: 1 })
              : one.stepped
              ? globalThis.uPlot.paths.stepped({ align: 1 })
              : undefined,
            dash: one.dash,
          })),
        ],
      },
      [x, ...series.map((one) => one.values)],
      frame,
    );
    if (options.marks) {
      place.plot.over.addEventListener("pointermove", (event) => {
        const [at, beside] = [0, NEAR_MARK].map((by) =>
          place.plot.posToVal(event.offsetX + by, "x")
        );
        said.textContent = nearestMark(place.marks, at, beside - at)?.text ?? "";
      });
    }
    if (options.onClick) {
      place.plot.over.addEventListener("click", () => {
        const at = place.plot.cursor.idx;
        if (at !== null && at !== undefined) options.onClick(at);
      });
      place.plot.over.style.cursor = "pointer";
    }
  };
  place.draw = draw;
  drawn.add(place);
  requestAnimationFrame(draw);
  return h(
    "div",
    { className: "chart-frame" },
    frame,
    options.marks && said,
    downloads({
      name: options.title ?? "chart",
      canvases: () => [...frame.querySelectorAll("canvas")],
      columns: () => [[options.xName ?? "x", x], ...series.map((one) => [one.label, one.values])],
    }),
  );
}

// How an axis of counts is written: nothing stands between two whole numbers.
export function counted(value) {
  return Number.isInteger(value) ? value.toLocaleString("en-US") : "";
}

// A line for each change, and a triangle on the axis for whatever else happened.
function drawMarks(plot, marks) {
  const { ctx: c, bbox: { left, top, width, height } } = plot;
  const ratio = devicePixelRatio || 1;
  c.save();
  for (const { at, color: name, isChange } of marks) {
    const x = plot.valToPos(at, "x", true);
    if (x < left || x > left + width) continue;
    c.fillStyle = color(name);
    if (isChange) c.fillRect(x - ratio, top, 2 * ratio, height);
    else {
      c.globalAlpha = 0.3;
      c.fillRect(x, top, ratio, height);
      c.globalAlpha = 1;
      c.beginPath();
      c.moveTo(x - 4 * ratio, top);
      c.lineTo(x + 4 * ratio, top);
      c.lineTo(x, top + 6 * ratio);
      c.fill();
    }
  }
  c.restore();
}

function alpha(text, share) {
  const match = /^#(..)(..)(..)$/.exec(text);
  if (!match) return text;
  return `rgba(${match.slice(1).map((part) => parseInt(part, 16)).join(",")},${share})`;
}

export function redrawCharts() {
  for (const place of drawn) {
    if (!place.frame.isConnected) drawn.delete(place);
    else place.draw();
  }
}

addEventListener("resize", () => redrawCharts());
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => redrawCharts());
