// Sections of the summary: the first rows of an answer, with the command that prints them.

import { breakable, h } from "./dom.js";
import { address } from "./address.js";
import { duration, pathText, percent } from "./labels.js";
import { dataTable } from "./table.js";
import { command, notes } from "./notice.js";

export function summary(table, options = {}) {
  const { reading, when_empty: nothing, shown, commands } = table.meta;
  if (!table.rows) {
    return [
      h("p", {}, reading ? `${reading}.` : nothing),
      notes(table.meta.notes),
      command(...commands),
    ];
  }
  const columns = shown.filter((name) =>
    Array.from(table[name]).some((value) => value !== null && value !== "" && !Number.isNaN(value))
  );
  return [
    reading && h("p", {}, `${reading}.`),
    dataTable(table, { columns, label: table.meta.title, ...options }),
    notes(table.meta.notes),
    command(...commands),
  ];
}

// A block for each culprit, the worst first; the last ones unfold.
const MOST_CULPRITS = 3;
export function verdict(table) {
  const blocks = Array.from({ length: table.rows }, (_, row) =>
    h(
      "div",
      // One that says that nothing stands out is no culprit.
      { className: table.kind[row] ? "culprit" : "healthy" },
      h("p", {}, h("b", {}, table.headline[row])),
      table.evidence[row].map((line) => h("p", {}, line)),
      table.next[row] && h("p", { className: "command" }, "next: ", h("code", {}, table.next[row])),
    ));
  const more = blocks.slice(MOST_CULPRITS);
  return [
    blocks.length ? blocks.slice(0, MOST_CULPRITS) : h("p", {}, table.meta.when_empty),
    more.length > 0 && h("details", {}, h("summary", {}, `${more.length} more`), more),
    notes(table.meta.notes),
    command(...table.meta.commands),
  ];
}

// Of each flow how long each of its nodes took: a bar of nodes, and their names.
export function blame(table) {
  const flows = new Map();
  for (let row = 0; row < table.rows; row++) {
    const rank = table.rank[row];
    flows.set(rank, [...(flows.get(rank) ?? []), row]);
  }
  let before = "";
  const list = [...flows.entries()].map(([rank, rows]) => {
    const [first] = rows;
    const path = pathText(table.path[first]);
    const item = h(
      "li",
      {},
      h(
        "p",
        { title: path },
        h("a", {
          href: address({
            page: "timeline",
            from: null,
            to: null,
            path: null,
            flow: `take:${table.take_id[first]}`,
            source: null,
          }),
        }, duration(table.latency_ns[first])),
        " ",
        h("span", { className: "path-text" }, breakable(withoutRepeated(path, before))),
      ),
      h(
        "ul",
        { className: "blame-nodes" },
        rows.map((row) => {
          const bar = h("span", { className: "blame-bar" });
          // The share of the table is rounded, and 0 for what is short.
          const share = table.duration_ns[row] / table.latency_ns[row] || 0;
          bar.style.width = `${Math.max(100 * share, 0.3)}%`;
          return h(
            "li",
            {},
            h("span", { className: "blame-node" }, breakable(table.node[row] ?? "not known")),
            h(
              "span",
              { className: "numbers" },
              `${duration(table.duration_ns[row])} · ${percent(share)}`,
            ),
            h("span", { className: "bar-track" }, bar),
          );
        }),
      ),
      command(table.meta.commands[rank - 1]),
    );
    before = path;
    return item;
  });
  return list.length
    ? [h("ol", { className: "blame" }, list), notes(table.meta.notes)]
    : [h("p", {}, table.meta.when_empty), notes(table.meta.notes)];
}

// A path without the steps at its begin that the one above it has too, as far as these are several.
export function withoutRepeated(path, before) {
  const [own, other] = [path.split(" → "), before.split(" → ")];
  let same = 0;
  while (same < own.length - 1 && own[same] === other[same]) same++;
  return same > 2 ? `${own[0]} → … → ${own.slice(same - 1).join(" → ")}` : path;
}
