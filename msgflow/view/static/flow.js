// A picked flow: its vertices once each, its links, and the chain that made the last effect late.

import { KIND_NAMES } from "./words.js";

export function buildFlow(table, picked) {
  const vertices = [];
  const places = new Map();
  const key = (kind, id) => `${kind}:${id}`;
  for (let row = 0; row < table.rows; row++) {
    const name = key(table.kind[row], table.id[row]);
    if (places.has(name)) continue;
    places.set(name, vertices.length);
    vertices.push({
      kind: table.kind[row], id: table.id[row], row: table.row_key[row], at: table.start_at[row],
      length: table.length[row], flags: table.flags[row], isEffect: table.is_effect[row],
      isCause: table.is_cause[row], critical: false,
      picked: KIND_NAMES[table.kind[row]] === picked.kind && table.id[row] === picked.id,
    });
  }
  const edges = [];
  for (let row = 0; row < table.rows; row++) {
    if (Number.isNaN(table.from_kind[row])) continue;
    const from = places.get(key(table.from_kind[row], table.from_id[row]));
    const to = places.get(key(table.kind[row], table.id[row]));
    if (from !== undefined && to !== undefined) edges.push({ from, to, kind: table.link_kind[row], critical: false });
  }
  const total = table.rows ? table.vertex_count[0] : 0;
  const flow = { vertices, edges, picked, total, leftOut: total - vertices.length, outside: table.meta.outside ?? 0 };
  markCritical(flow);
  return flow;
}

// From the last effect back: of several causes the one that came last, for it the others waited.
// Among the causes of a flow without effects the same from what was picked.
function markCritical(flow) {
  const { vertices, edges } = flow;
  const incoming = new Map();
  edges.forEach((edge, place) => {
    const list = incoming.get(edge.to) ?? [];
    list.push(place);
    incoming.set(edge.to, list);
  });
  const end = (vertex) => vertex.at + vertex.length;
  let last = -1;
  vertices.forEach((vertex, place) => {
    if (last < 0 || end(vertex) > end(vertices[last])) last = place;
  });
  const seen = new Set();
  while (last >= 0 && !seen.has(last)) {
    seen.add(last);
    vertices[last].critical = true;
    const into = incoming.get(last) ?? [];
    let latest = -1;
    for (const place of into) {
      const cause = vertices[edges[place].from];
      if (latest < 0 || arrival(edges[place], cause) > arrival(edges[latest], vertices[edges[latest].from])) latest = place;
    }
    if (latest < 0) break;
    edges[latest].critical = true;
    last = edges[latest].from;
  }
}

function arrival(edge, cause) {
  return edge.kind === "direct" ? cause.at : cause.at + cause.length;
}

export function extent(flow) {
  let [from, to] = [Infinity, -Infinity];
  for (const vertex of flow.vertices) {
    from = Math.min(from, vertex.at);
    to = Math.max(to, vertex.at + vertex.length);
  }
  return { from, to };
}
