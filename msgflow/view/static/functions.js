// Functions: where the CPU time of callbacks went, as samples of their stacks tell, as flame graphs.

import { clear, color, h } from "./dom.js";
import { count, percent } from "./labels.js";
import { command, failed, notes, waiting } from "./notice.js";

// Levels above the functions: everything, the node, its callback.
const NAMED = 3;
const CHOICES = [1, 10, 100, 1000];
const HELP =
  "Where CPU time went, as samples of stacks tell: below each node its callbacks, below these what they called. The wider, the more samples. A click makes a node, a callback or a function as wide as the picture.";

// Of all nodes and callbacks. Only a server has the library: a report goes without it.
export async function functions(app) {
  const table = await sampled(app);
  return table && framed(HELP, await graphs(table, ["all samples"]));
}

// Of the callbacks on the way of a path's flows: the slowest of these beside the others.
export async function pathFunctions(app, path) {
  const wanted = (slowest) => sampled(app, { path, slowest });
  const names = (slowest) => [
    slowest === 1 ? "the slowest flow" : `the slowest ${count(slowest, "flow")}`,
    "the other flows",
  ];
  const first = await wanted(CHOICES[1]);
  if (!first) return null;
  const place = h("div", {}, await graphs(first, names(CHOICES[1])));
  const choice = h(
    "select",
    {
      "aria-label": "how many flows are the slowest",
      on: {
        change: async () => {
          const slowest = Number(choice.value);
          clear(place, waiting("looking for their functions …"));
          try {
            clear(place, await graphs(await wanted(slowest), names(slowest)));
          } catch (error) {
            if (error.name !== "AbortError") clear(place, failed(error));
          }
        },
      },
    },
    CHOICES.map((number) => h("option", { value: number }, `${names(number)[0]}, and the others`)),
  );
  choice.value = String(CHOICES[1]);
  return framed(
    `${HELP} A function that is wider for the slowest flows than for the others took more of their CPU time. All that callbacks on the way did counts, also behind what they published.`,
    h("div", { className: "tools" }, choice),
    place,
  );
}

async function sampled(app, params = {}) {
  const table = app.source.isServed && await app.inWindow("stack", params);
  return table?.rows ? table : null;
}

function framed(help, ...content) {
  return h(
    "section",
    {},
    h("h2", {}, "Functions"),
    h("p", { className: "soft" }, help),
    content,
  );
}

// One picture for each part of the table, below a field that marks functions in all of them.
async function graphs(table, names) {
  const library = await import("./flamegraph.min.js");
  const made = names.map((name, part) => flame(tree(table, part, name), library));
  const field = h("input", {
    type: "search",
    placeholder: "function …",
    "aria-label": "mark functions with this text",
    on: {
      input: () => {
        const text = field.value.trim();
        // The library takes the text for a pattern.
        const pattern = text.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");
        for (const { chart } of made) text ? chart.search(pattern) : chart.clear();
      },
    },
  });
  const reset = () => made.forEach(({ chart }) => chart.resetZoom());
  return [
    h(
      "div",
      { className: "tools" },
      field,
      h("button", { type: "button", on: { click: reset } }, "all of it"),
    ),
    h("div", { className: "flames" }, made.map(({ picture }) => picture)),
    table.meta.left_out > 0 &&
    notes([`${count(table.meta.left_out, "rarer stack")} left out of the picture`]),
    command(table.meta.command),
  ];
}

function flame(root, { flamegraph, select }) {
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
    "aria-label": `flame graph of functions: ${root.name}`,
  });
  const draw = new ResizeObserver(() => {
    const width = frame.clientWidth;
    if (!width || width === chart.width()) return;
    chart.width(width);
    if (frame.firstChild) chart.update();
    else select(frame).datum(root).call(chart);
  });
  draw.observe(frame);
  return {
    chart,
    picture: root.value
      ? h("div", {}, frame, said)
      : h("p", { className: "soft" }, `${root.name}: no samples`),
  };
}

// Stacks with what they begin with in common.
function tree(table, part, title) {
  const made = (name) => ({ name, value: 0, children: [], known: new Map() });
  const root = made(title);
  for (let row = 0; row < table.rows; row++) {
    if (table.part[row] !== part) continue;
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
