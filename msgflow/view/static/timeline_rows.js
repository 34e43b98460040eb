// Rows of the timeline: which there are, in which order, and where they lie on the canvas.

import { COUNTER_KINDS } from "./counters.js";
import { shortSymbol } from "./symbols.js";

export const HEIGHTS = { critical: 26, host: 22, process: 20, node: 20, row: 20 };

// Kinds of rows that may be hidden, and what the boxes for that say.
export const ROW_KINDS = {
  timer: "timers",
  subscription: "subscriptions",
  service: "services",
  client: "clients",
  publisher: "publishers",
  event: "events of your own",
  state: "states of managed nodes",
  thread: "executors",
  schedule: "threads to the kernel",
  core: "cores",
  queue: "queues of several messages",
  rate: "rates",
  cpu: "CPU use",
};
// Kinds of rows that are hidden until somebody wants to see them.
export const KINDS_HIDDEN_FIRST = ["rate"];
// Kinds of rows that only recordings with a kernel trace have.
export const KERNEL_KINDS = new Set(["schedule", "core"]);
const OF_PROCESS = new Set(["thread", "schedule", "core", "cpu"]);

// Options: internal, query, hidden (Set of row keys), folded (Set of header keys), kinds (Set that
// is hidden), pinned (Set of row keys that come first), only (Set of row keys, or null), critical (whether there is a critical path).
export function layout(rows, options) {
  const lanes = [];
  let y = 0;
  let [host, process, node] = [null, null, null];
  let [hostFolded, processFolded, nodeFolded, isOneNode] = [false, false, false, false];
  let hiddenCount = 0;
  const query = (options.query ?? "").trim().toLowerCase();
  const found = query ? search(rows, query) : null;
  const push = (lane) => {
    lane.y = y;
    lane.height = HEIGHTS[lane.type];
    y += lane.height;
    lanes.push(lane);
  };
  const isPinned = (row) => options.pinned?.has(rows.row_key[row]);
  const nodes = nodesOf(rows);
  for (let row = 0; row < rows.rows; row++) {
    if (isPinned(row)) {
      push({
        type: "row",
        key: rows.row_key[row],
        kind: rows.kind[row],
        label: `${rows.label[row]} · ${rows.node[row] ?? rows.process[row]}`,
        isPinned: true,
        isCounter: COUNTER_KINDS.has(rows.kind[row]),
        most: rows.most?.[row],
        row,
      });
    }
  }
  if (options.critical) push({ type: "critical", key: "critical", label: "critical path" });
  for (let row = 0; row < rows.rows; row++) {
    const key = rows.row_key[row];
    const kind = rows.kind[row];
    const isAsked = options.only ? options.only.has(key) : true;
    if (!isAsked || isPinned(row)) continue;
    if (!options.only) {
      if (rows.is_internal[row] && !options.internal) {
        hiddenCount++;
        continue;
      }
      if (options.hidden.has(key) || options.kinds.has(kind)) {
        hiddenCount++;
        continue;
      }
      if (found && !found.has(row)) {
        hiddenCount++;
        continue;
      }
    }
    const hostKey = `host:${rows.host[row]}`;
    const processKey = `process:${rows.process_id[row]}`;
    // Threads stand below the process, and cores below the host, without a node.
    const nodeKey = OF_PROCESS.has(kind) ? null : `node:${rows.process_id[row]}:${rows.node[row]}`;
    if (hostKey !== host) {
      host = hostKey;
      process = node = null;
      hostFolded = options.folded.has(hostKey);
      push({ type: "host", key: hostKey, label: rows.host[row], folded: hostFolded, row });
    }
    if (hostFolded) continue;
    if (processKey !== process) {
      process = processKey;
      node = null;
      processFolded = options.folded.has(processKey);
      const [only, ...others] = nodes.get(rows.process_id[row]) ?? [];
      isOneNode = only !== undefined && others.length === 0;
      push({
        type: "process",
        key: processKey,
        // What has one node is called by it.
        label: isOneNode ? `${only} · ${rows.process[row]}` : rows.process[row],
        folded: processFolded,
        row,
      });
    }
    if (processFolded) continue;
    if (nodeKey !== node) {
      node = nodeKey;
      nodeFolded = nodeKey !== null && options.folded.has(nodeKey);
      const label = rows.node[row] ?? "node not known";
      const isShown = nodeKey !== null && !(isOneNode && rows.node[row]);
      if (isShown) push({ type: "node", key: nodeKey, label, folded: nodeFolded, row });
    }
    if (nodeFolded) continue;
    push({
      type: "row",
      key,
      kind,
      label: rows.label[row],
      // The functions of its callbacks.
      name: rows.symbol[row] ? shortSymbol(rows.symbol[row]).replace("bound method of ", "") : null,
      isInternal: rows.is_internal[row],
      isCounter: COUNTER_KINDS.has(kind),
      most: rows.most?.[row],
      isBeside: found?.get(row) === "beside",
      row,
    });
  }
  return { lanes, height: y, hiddenCount };
}

function nodesOf(rows) {
  const nodes = new Map();
  for (let row = 0; row < rows.rows; row++) {
    if (!rows.node[row]) continue;
    const process = rows.process_id[row];
    if (!nodes.has(process)) nodes.set(process, new Set());
    nodes.get(process).add(rows.node[row]);
  }
  return nodes;
}

// Rows with a text, and beside them what exchanges messages with them: rows of the same topic or
// service; of what has the text itself also the other rows of its node.
const EXCHANGED = new Set(["publisher", "subscription", "service", "client"]);
export function search(rows, query) {
  const found = new Map();
  const [names, nodes] = [new Set(), new Set()];
  const nodeOf = (row) => `${rows.process_id[row]} ${rows.node[row]}`;
  for (let row = 0; row < rows.rows; row++) {
    if (!matches(rows, row, query)) continue;
    found.set(row, "found");
    if (EXCHANGED.has(rows.kind[row])) names.add(rows.label[row]);
    if (rows.node[row] && rows.label[row]?.toLowerCase().includes(query)) nodes.add(nodeOf(row));
  }
  for (let row = 0; row < rows.rows; row++) {
    const isBeside = (EXCHANGED.has(rows.kind[row]) && names.has(rows.label[row])) ||
      (rows.node[row] && nodes.has(nodeOf(row)));
    if (isBeside && !found.has(row)) found.set(row, "beside");
  }
  return found;
}

export function matches(rows, row, query) {
  return ["label", "symbol", "node", "process", "host", "kind"].map((name) => rows[name][row])
    .some((text) => text && text.toLowerCase().includes(query));
}

// Bars by row of the timeline: from where to where they lie in the table, and how far the longest
// of those before each reaches, so that what begins left of the window is found.
export function indexBars(table) {
  const ranges = new Map();
  const reach = new Float64Array(table.rows);
  const { row_key: keys, start_at: starts, length: lengths } = table;
  let from = 0;
  for (let at = 0; at < table.rows; at++) {
    if (at === from || keys[at] !== keys[at - 1]) {
      if (at > from) ranges.set(keys[at - 1], [from, at]);
      from = at;
      reach[at] = starts[at] + lengths[at];
    } else {
      reach[at] = Math.max(reach[at - 1], starts[at] + lengths[at]);
    }
  }
  if (table.rows) ranges.set(keys[table.rows - 1], [from, table.rows]);
  return { table, ranges, reach };
}

// First position in values[from, to) that is not below the limit; values rise.
export function lowerBound(values, from, to, limit) {
  while (from < to) {
    const middle = (from + to) >> 1;
    if (values[middle] < limit) from = middle + 1;
    else to = middle;
  }
  return from;
}
