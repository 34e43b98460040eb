// A picked flow: its vertices once each, its links, and what of it lies on the critical path.

import { KIND_NAMES } from "./labels.js";

export function buildFlow(table, picked) {
  const vertices = [];
  const places = new Map();
  const key = (kind, id) => `${kind}:${id}`;
  for (let row = 0; row < table.rows; row++) {
    const name = key(table.kind[row], table.id[row]);
    if (places.has(name)) continue;
    places.set(name, vertices.length);
    vertices.push({
      kind: table.kind[row],
      id: table.id[row],
      row: table.row_key[row],
      at: table.start_at[row],
      length: table.length[row],
      flags: table.flags[row],
      isEffect: table.is_effect[row],
      isCause: table.is_cause[row],
      critical: false,
      picked: KIND_NAMES[table.kind[row]] === picked.kind && table.id[row] === picked.id,
    });
  }
  const edges = [];
  for (let row = 0; row < table.rows; row++) {
    if (Number.isNaN(table.from_kind[row])) continue;
    const from = places.get(key(table.from_kind[row], table.from_id[row]));
    const to = places.get(key(table.kind[row], table.id[row]));
    if (from !== undefined && to !== undefined) {
      edges.push({ from, to, kind: table.link_kind[row], critical: false });
    }
  }
  const total = table.rows ? table.vertex_count[0] : 0;
  const flow = {
    vertices,
    edges,
    picked,
    total,
    leftOut: total - vertices.length,
    outside: table.meta.outside ?? 0,
    pieces: null,
  };
  return flow;
}

// Marks what the query critical-path names: its callback instances and messages, and the takes
// between them. It may name others besides, which the flow waited for without being part of them.
export function markCritical(flow, pieces) {
  const { vertices, edges } = flow;
  const named = [new Set(), new Set()];
  for (let row = 0; row < pieces.rows; row++) {
    named[0].add(pieces.callback_instance_id[row]);
    named[1].add(pieces.publication_id[row]);
  }
  const last = pieces.rows ? pieces.take_id[0] : null;
  for (const vertex of vertices) {
    vertex.critical = vertex.kind < 2
      ? named[vertex.kind].has(vertex.id)
      : vertex.kind === 2 && vertex.id === last;
  }
  for (const edge of edges) {
    const [take, callback] = [vertices[edge.from], vertices[edge.to]];
    if (edge.kind !== "callback" || !callback.critical || take.kind !== 2) continue;
    if (edges.some((other) => other.to === edge.from && vertices[other.from].critical)) {
      take.critical = true;
    }
  }
  for (const edge of edges) {
    edge.critical = vertices[edge.from].critical && vertices[edge.to].critical;
  }
  flow.pieces = pieces;
}

export function extent(flow) {
  let [from, to] = [Infinity, -Infinity];
  for (const vertex of flow.vertices) {
    from = Math.min(from, vertex.at);
    to = Math.max(to, vertex.at + vertex.length);
  }
  return { from, to };
}
