// What the graph is made of: nodes, topics, services and actions, and what goes between them.

import { brief, count, duration } from "./labels.js";

// The services of an action are one vertex: the action.
const OF_ACTION = "/_action/";

export function model(
  { rates, transports, services, actions, indirect, executors, callbacks, drops },
) {
  const vertices = new Map();
  const groups = new Map();
  const edges = [];
  const groupOf = new Map();
  const kindsOf = new Map();
  for (let row = 0; row < executors.rows; row++) {
    const key = `executor ${executors.executor_id[row]}`;
    groups.set(key, {
      host: executors.host[row],
      lines: [
        `${executors.process[row]} on ${executors.host[row]}`,
        `${String(executors.executor_kind[row]).replace("_", "-")}, ${
          count(executors.threads[row], "thread")
        }`,
      ],
    });
    // A node of several executors belongs to none of them alone.
    groupOf.set(executors.node[row], groupOf.has(executors.node[row]) ? null : key);
  }
  for (let row = 0; row < indirect.rows; row++) {
    for (const topic of String(indirect.outputs[row] ?? "").split(/, */)) {
      kindsOf.set(`${indirect.node[row]}>${topic}`, indirect.kind[row]);
    }
  }
  const add = (kind, label, under) => {
    const key = `${kind}:${label}`;
    const known = vertices.get(key);
    if (!known) {
      vertices.set(key, {
        key,
        kind,
        label,
        under: under ?? null,
        group: kind === "node" ? groupOf.get(label) ?? null : null,
      });
    } else if (under && !known.under) known.under = under;
    return key;
  };
  const rate = new Map();
  for (let row = 0; row < rates.rows; row++) {
    const topic = rates.topic_name[row] ?? "?";
    rate.set(
      topic,
      (rate.get(topic) ?? 0) + (Number.isNaN(rates.rate_hz[row]) ? 0 : rates.rate_hz[row]),
    );
  }
  for (let row = 0; row < rates.rows; row++) {
    const topic = rates.topic_name[row] ?? "?";
    const node = rates.publisher[row];
    const kind = kindsOf.get(`${node}>${topic}`) ?? null;
    edges.push({
      from: add("node", node),
      to: add(
        "topic",
        topic,
        `${rate.get(topic).toLocaleString("en-US", { maximumFractionDigits: 1 })} Hz`,
      ),
      kind: "publish",
      indirect: kind,
      count: rates.count[row],
      label: "",
      title: `${node} published ${count(rates.count[row], "message")} on ${topic}${
        kind ? `, by an indirect link (${kind})` : ""
      }`,
    });
  }
  for (let row = 0; row < transports.rows; row++) {
    const topic = transports.topic_name[row] ?? "?";
    const node = transports.subscriber[row];
    const known = !Number.isNaN(transports.median_ns[row]);
    edges.push({
      from: add("topic", topic),
      to: add("node", node),
      kind: "receive",
      indirect: null,
      median: known ? transports.median_ns[row] : undefined,
      count: transports.takes[row],
      label: known ? `${brief(transports.median_ns[row])} · ${brief(transports.p95_ns[row])}` : "",
      title: `${node} received ${count(transports.takes[row], "message")} on ${topic}${
        known
          ? `: ${duration(transports.median_ns[row])} median, ${
            duration(transports.p95_ns[row])
          } p95`
          : ", none with a known publication"
      }`,
    });
  }
  for (let row = 0; row < services.rows; row++) {
    const name = services.service_name[row] ?? "?";
    if (name.includes(OF_ACTION)) continue;
    const under = Number.isNaN(services.round_trip_median_ns[row])
      ? null
      : `${duration(services.round_trip_median_ns[row])} median`;
    const service = add("service", name, under);
    const said = `${count(services.requests[row], "request")}${
      under ? `, round trip ${under}, ${duration(services.round_trip_p95_ns[row])} p95` : ""
    }`;
    if (services.client[row]) {
      edges.push({
        from: add("node", services.client[row]),
        to: service,
        kind: "service",
        count: services.requests[row],
        label: "",
        title: `${services.client[row]} called ${name}: ${said}`,
      });
    }
    if (services.server[row]) {
      edges.push({
        from: service,
        to: add("node", services.server[row]),
        kind: "service",
        count: services.requests[row],
        label: "",
        title: `${services.server[row]} serves ${name}: ${said}`,
      });
    }
  }
  for (let row = 0; row < actions.rows; row++) {
    const name = actions.action_name[row];
    const under = Number.isNaN(actions.result_median_ns[row])
      ? null
      : `${duration(actions.result_median_ns[row])} median`;
    const action = add("action", name, under);
    const said = `${count(actions.goals[row], "goal")}${
      under ? `, to the result ${under}, ${duration(actions.result_p95_ns[row])} p95` : ""
    }`;
    if (actions.client[row]) {
      edges.push({
        from: add("node", actions.client[row]),
        to: action,
        kind: "service",
        count: actions.goals[row],
        label: "",
        title: `${actions.client[row]} sent to ${name}: ${said}`,
      });
    }
    if (actions.server[row]) {
      edges.push({
        from: action,
        to: add("node", actions.server[row]),
        kind: "service",
        count: actions.goals[row],
        label: "",
        title: `${actions.server[row]} executes ${name}: ${said}`,
      });
    }
  }
  markGraph({ vertices, edges, callbacks, drops });
  return {
    vertices,
    edges: merged(edges),
    groups,
    hosts: [...new Set([...groups.values()].map(({ host }) => host))].sort(),
  };
}

// Of each node its share of the slowest flow. Tells whether there is any.
export function markSlowest(vertices, blame) {
  let isAny = false;
  for (let row = 0; row < blame.rows; row++) {
    const vertex = blame.rank[row] === 1 && vertices.get(`node:${blame.node[row]}`);
    if (!vertex) continue;
    vertex.slowest = blame.share[row];
    isAny = true;
  }
  return isAny;
}

// Of each node how long its callbacks ran; of each receiver what it did not get.
function markGraph({ vertices, edges, callbacks, drops }) {
  for (let row = 0; row < callbacks.rows; row++) {
    const vertex = vertices.get(`node:${callbacks.node[row]}`);
    if (vertex && callbacks.total_ns[row] > 0) {
      vertex.busy = (vertex.busy ?? 0) + callbacks.total_ns[row];
    }
  }
  const most = Math.max(1, ...[...vertices.values()].map((vertex) => vertex.busy ?? 0));
  for (const vertex of vertices.values()) vertex.heat = (vertex.busy ?? 0) / most;
  for (let row = 0; row < drops.rows; row++) {
    const missing = drops.dropped[row] + drops.lost[row];
    const edge = missing > 0 &&
      edges.find((one) =>
        one.from === `topic:${drops.topic_name[row]}` && one.to === `node:${drops.subscriber[row]}`
      );
    if (!edge) continue;
    edge.missing = (edge.missing ?? 0) + missing;
    edge.title += `\n${count(drops.dropped[row], "message")} dropped, ${
      drops.lost[row].toLocaleString("en-US")
    } lost: ${drops.reasons[row]}`;
  }
}

function merged(edges) {
  const known = new Map();
  for (const edge of edges) {
    const key = `${edge.from}>${edge.to}`;
    if (known.has(key)) {
      const first = known.get(key);
      first.count += edge.count;
      if (edge.missing) first.missing = (first.missing ?? 0) + edge.missing;
      if (!first.title.includes(edge.title)) first.title += `\n${edge.title}`;
    } else known.set(key, edge);
  }
  return [...known.values()];
}
