// Functions: where the CPU time of callbacks went, as samples of their stacks tell, as a flame graph.

import { clear, color, h } from "./dom.js";
import { count, percent } from "./labels.js";
import { command, notes } from "./notice.js";

// Levels above the functions: everything, the node, its callback.
const NAMED = 3;

// Only a server has the library: a report goes without it.
export async function functions(app) {
  const table = app.source.isServed && await app.inWindow("stack");
  if (!table?.rows) return null;
  const { flamegraph, select } = await import("./flamegraph.min.js");
  const root = tree(table);
  const said = h("p", { className: "status", role: "status" });
  const say = ({ data }) =>
    clear(
      said,
      `${data.name}: ${percent(data.value / root.value)}, ${count(data.value, "sample")}`,
    );
  const chart = flamegraph().cellHeight(19).transitionDuration(150).minFrameSize(1).inverted(true)
    .label(({ data }) => `${data.name}: ${count(data.value, "sample")}`)
    .setColorMapper((node, own) =>
      node.highlight ? color("pick") : node.depth < NAMED ? color("stripe") : own
    )
    .onHover(say).onClick(say);
  const frame = h("div", {
    className: "flame",
    role: "img",
    "aria-label": "flame graph of the functions of callbacks",
  });
  const draw = new ResizeObserver(() => {
    const width = frame.clientWidth;
    if (!width || width === chart.width()) return;
    chart.width(width);
    if (frame.firstChild) chart.update();
    else select(frame).datum(root).call(chart);
  });
  draw.observe(frame);
  const field = h("input", {
    type: "search",
    placeholder: "function …",
    "aria-label": "mark functions with this text",
    on: {
      input: () => {
        const text = field.value.trim();
        // The library takes the text for a pattern.
        if (text) chart.search(text.replace(/[.*+?^${}()|[\]\\]/g, "\\$&"));
        else chart.clear();
      },
    },
  });
  const all = h("button", { type: "button", on: { click: () => chart.resetZoom() } }, "all of it");
  return h(
    "section",
    {},
    h("h2", {}, "Functions"),
    h(
      "p",
      { className: "soft" },
      "Where CPU time went, as samples of stacks tell: below each node its callbacks, below these what they called. The wider, the more samples. A click makes a node, a callback or a function as wide as the page.",
    ),
    h("div", { className: "tools" }, field, all),
    frame,
    said,
    table.meta.left_out > 0 &&
      notes([`${count(table.meta.left_out, "rarer stack")} left out of the picture`]),
    command(table.meta.command),
  );
}

// Stacks with what they begin with in common.
function tree(table) {
  const made = (name) => ({ name, value: 0, children: [], known: new Map() });
  const root = made("all samples");
  for (let row = 0; row < table.rows; row++) {
    let place = root;
    place.value += table.samples[row];
    for (const name of table.stack[row].split(";")) {
      if (!place.known.has(name)) {
        const child = made(name);
        place.known.set(name, child);
        place.children.push(child);
      }
      place = place.known.get(name);
      place.value += table.samples[row];
    }
  }
  return root;
}
