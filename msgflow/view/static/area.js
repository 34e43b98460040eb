// An area of the timeline: how long its callbacks ran, and what its threads did, in sums.

import { clear, h } from "./dom.js";
import { duration, moment } from "./labels.js";
import { failed, waiting } from "./notice.js";
import { summary } from "./summary.js";

// The lanes between two heights of the picture; all of them where these are the same.
export function lanesBetween(lanes, top, bottom) {
  const [low, high] = [Math.min(top, bottom), Math.max(top, bottom)];
  if (high - low < 8) return lanes;
  return lanes.filter((lane) => lane.y + lane.height > low && lane.y < high);
}

// Nodes and threads that have a row among the lanes.
export function inArea(lanes, rows) {
  const [nodes, threads] = [new Set(), new Set()];
  for (const lane of lanes) {
    if (lane.type !== "row") continue;
    if (lane.kind === "thread") threads.add(rows.object_id[lane.row]);
    else if (rows.node[lane.row]) nodes.add(rows.node[lane.row]);
  }
  return { nodes: [...nodes], threads: [...threads] };
}

export async function showArea(place, app, { from, to, nodes, threads }) {
  const head = () => h("h3", {}, `${duration(to - from)} from ${moment(from)}`);
  if (!app.source.isServed) {
    clear(
      place,
      head(),
      h(
        "p",
        { className: "soft" },
        "A report has no sums of a part of the timeline: msgflow ui has.",
      ),
    );
    return;
  }
  clear(place, head(), waiting("summing up …"));
  const window = { start: Math.round(from), end: Math.round(to) };
  const parts = [nodes.length && ["callbacks", nodes], threads.length && ["usage", threads]].filter(
    Boolean,
  );
  try {
    const tables = await Promise.all(
      parts.map(([part, of]) => app.fetch("area", { part, of: JSON.stringify(of), ...window })),
    );
    clear(
      place,
      head(),
      tables.length
        ? tables.map((table) => h("section", {}, h("h3", {}, table.meta.title), summary(table)))
        : h("p", {}, "No row of a node or thread lies in it."),
    );
  } catch (error) {
    clear(place, head(), failed(error));
  }
}
