// The graph of nodes, topics, services and actions, with rates on topics and latencies on edges.

import { h, svg, clear, color } from "./dom.js";
import { address, current, replace } from "./address.js";
import { brief, count, duration } from "./labels.js";
import { dataTable, besides } from "./table.js";
import { command, failed, notes, waiting } from "./notice.js";

// What is laid out without being asked: beyond it the layout takes longer than one waits.
const MOST_VERTICES = 260;
// An edge whose median is so many times that of the middle edge is drawn as slow.
const SLOW = 10;
// What is smaller cannot be read: then one scrolls.
const LEAST_SCALE = 0.8;
// Hosts have a colour each, as far as there are some in the style sheet.
const HOSTS = 5;
// The services of an action are one vertex: the action.
const OF_ACTION = "/_action/";
const INDIRECT = { periodic_async: "8 4", partial_sync: "2 4", approximate_sync: "2 4" };

export class GraphPage {
  constructor(app, root) {
    this.app = app;
    this.root = root;
    this.grouped = true;
    this.ready = this.build();
  }

  async build() {
    clear(this.root, waiting());
    const { app } = this;
    const [rates, transports, services, actions, indirect, executors, rows] = await Promise.all([
      app.query("topics-rate"), app.query("topics-latency"), app.query("service-latency"), app.query("action-latency"),
      app.query("links"), app.fetch("executor_node"), app.fetch("row"),
    ]);
    this.tables = { rates, transports, services, actions };
    this.model = model({ rates, transports, services, actions, indirect, executors, rows });
    this.search = h("input", { type: "search", placeholder: "node or topic …", value: current().q ?? "", "aria-label": "only what is beside nodes and topics with this text",
      on: { change: () => this.filter(this.search.value) } });
    const group = h("input", { type: "checkbox", checked: true, on: { change: () => { this.grouped = group.checked; this.draw(); } } });
    this.picture = h("div", { className: "graph", tabIndex: 0, role: "region", "aria-label": "graph of nodes and topics" });
    this.said = h("p", { className: "status", role: "status" });
    clear(this.root,
      h("div", { className: "tools" }, this.search, h("button", { type: "button", on: { click: () => this.filter("") } }, "all"), h("label", {}, group, "group by executor")),
      this.said, this.picture,
      h("div", { className: "legend" },
        item("box", "node"), item("pill", "topic, with its rate"), item("diamond", "service, with its round trip"), actions.rows && item("action", "action, with the time from a goal to its result"),
        h("span", { className: "legend-item" }, h("span", { className: "stroke color-transport" }), "published, received: median · p95 from publication to take"),
        h("span", { className: "legend-item" }, h("span", { className: "stroke dashed color-indirect" }), "published by an indirect link"),
        this.model.edges.some((edge) => edge.median >= this.model.slow) && h("span", { className: "legend-item" }, h("span", { className: "stroke color-critical" }), `slow: a median of ${brief(this.model.slow)} or more, ${SLOW} times that of the middle one`),
        this.model.hosts.length > 1 && this.model.hosts.map((host, place) => h("span", { className: "legend-item" }, h("span", { className: `swatch host-mark host-${place % HOSTS}` }), `on ${host}`))),
      besides("topics and their publishers as a table", dataTable(rates, { label: "publication rates" }), command(rates.meta.command)),
      besides("receivers and their latencies as a table", dataTable(transports, { label: "latencies from publication to take" }), notes(transports.meta.notes), command(transports.meta.command)),
      services.rows ? besides("services as a table", dataTable(services, { label: "services" }), command(services.meta.command)) : null,
      actions.rows ? besides("actions as a table", dataTable(actions, { label: "actions" }), command(actions.meta.command)) : null);
    this.draw();
  }

  filter(text) {
    this.search.value = text;
    replace({ page: "graph", q: text || null });
    this.app.linksMoved();
    this.draw();
  }

  draw() {
    const { vertices, edges } = this.model;
    const text = (current().q ?? "").toLowerCase();
    let chosen = new Set(vertices.keys());
    if (text) {
      const hit = [...vertices.values()].filter((vertex) => vertex.label.toLowerCase().includes(text)).map((vertex) => vertex.key);
      chosen = new Set(hit);
      for (const edge of edges) if (hit.includes(edge.from) || hit.includes(edge.to)) { chosen.add(edge.from); chosen.add(edge.to); }
    }
    const all = chosen.size;
    let note = text ? `${all} of ${vertices.size} nodes, topics, services and actions: those with “${text}” and what is beside them.` : `${all} nodes, topics, services and actions. Click one to see what is beside it.`;
    if (all > MOST_VERTICES && !this.everything) {
      const weight = new Map();
      for (const edge of edges) for (const end of [edge.from, edge.to]) weight.set(end, (weight.get(end) ?? 0) + edge.count);
      chosen = new Set([...chosen].sort((a, b) => (weight.get(b) ?? 0) - (weight.get(a) ?? 0)).slice(0, MOST_VERTICES));
      note = `${MOST_VERTICES} of ${all} nodes, topics, services and actions, those with the most messages: search for others. `;
    }
    clear(this.said, note, all > MOST_VERTICES && !this.everything && h("button", { type: "button", on: { click: () => { this.everything = true; this.draw(); } } }, "draw all of them, which takes long"));
    if (!chosen.size) { clear(this.picture, h("p", { className: "nothing" }, vertices.size ? "Nothing has this in its name." : "There are no nodes that publish, receive, or call.")); return; }
    try {
      clear(this.picture, this.layout(chosen, edges.filter((edge) => chosen.has(edge.from) && chosen.has(edge.to))));
      // Where the picture is larger than its place, what comes first is in the middle.
      this.picture.scrollLeft = this.first.x - this.picture.clientWidth / 2;
      this.picture.scrollTop = this.first.y - this.picture.clientHeight / 2;
    } catch (error) {
      clear(this.picture, failed(error));
    }
  }

  layout(chosen, edges) {
    const room = this.picture.clientWidth || 900;
    let graph = this.place(chosen, edges, room < 700 ? "TB" : "LR");
    // Long chains are read from the top where a line of them would become too small.
    if (room >= 700 && (room - 4) / graph.graph().width < LEAST_SCALE) graph = this.place(chosen, edges, "TB");
    return this.paint(graph, chosen, edges, room);
  }

  place(chosen, edges, direction) {
    const dagre = globalThis.dagre;
    const graph = new dagre.graphlib.Graph({ compound: true, multigraph: true });
    graph.setGraph({ rankdir: direction, nodesep: this.grouped ? 34 : 16, ranksep: direction === "TB" ? 22 : 34, edgesep: 10, marginx: 14, marginy: 22 });
    graph.setDefaultEdgeLabel(() => ({}));
    for (const key of chosen) {
      const vertex = this.model.vertices.get(key);
      const wide = Math.max(...[vertex.label, vertex.under].filter(Boolean).map((text) => Math.min(text.length, 34) * 7.6)) + 26;
      graph.setNode(key, { width: Math.max(wide, 60), height: vertex.under ? 40 : 28 });
      if (this.grouped && vertex.group) {
        graph.setNode(vertex.group, {});
        graph.setParent(key, vertex.group);
      }
    }
    edges.forEach((edge, place) => graph.setEdge(edge.from, edge.to, { width: edge.label ? 122 : 0, height: edge.label ? 14 : 0, labelpos: "c" }, String(place)));
    dagre.layout(graph);
    return graph;
  }

  paint(graph, chosen, edges, room) {
    const { vertices, groups, hosts } = this.model;
    const used = new Set([...chosen].map((key) => vertices.get(key).group).filter((group) => this.grouped && group));
    const { width, height } = graph.graph();
    // Made smaller to fit, but not beyond what can be read.
    const scale = Math.min(1, Math.max((room - 4) / width, LEAST_SCALE));
    const root = svg("svg", { width: Math.ceil(width * scale), height: Math.ceil(height * scale), viewBox: `0 0 ${Math.ceil(width)} ${Math.ceil(height)}`, role: "img", "aria-label": "graph of nodes and topics" });
    root.append(svg("defs", {}, ["transport", "indirect", "service", "slow"].map((name) => svg("marker", { id: `tip-${name}`, viewBox: "0 0 8 8", refX: 7, refY: 4, markerWidth: name === "slow" ? 4 : 7, markerHeight: name === "slow" ? 4 : 7, orient: "auto" },
      svg("path", { d: "M0,0 L8,4 L0,8 z", class: `fill-${name}` })))));
    const along = graph.graph().rankdir === "TB" ? "y" : "x";
    const first = [...chosen].map((key) => graph.node(key)).reduce((a, b) => (b[along] < a[along] ? b : a));
    this.first = { x: first.x * scale, y: first.y * scale };
    const names = [];
    for (const key of used) {
      const box = graph.node(key);
      root.append(svg("rect", { x: box.x - box.width / 2, y: box.y - box.height / 2 - 10, width: box.width, height: box.height + 10, rx: 8, class: `group-box host-${hosts.indexOf(groups.get(key).host) % HOSTS}` }));
      const { text } = groups.get(key);
      names.push(svg("text", { x: box.x - box.width / 2 + 8, y: box.y - box.height / 2 + 3, class: "group-text" }, shortened(text, Math.max(Math.floor((box.width - 16) / 6.8), 8)), svg("title", {}, text)));
    }
    edges.forEach((edge, place) => {
      const line = graph.edge(edge.from, edge.to, String(place));
      const isSlow = edge.median >= this.model.slow;
      const style = isSlow ? "slow" : edge.indirect ? "indirect" : edge.kind === "service" ? "service" : "transport";
      root.append(svg("path", { d: curve(line.points), class: `edge stroke-${style}`, "stroke-dasharray": INDIRECT[edge.indirect] ?? null, "marker-end": `url(#tip-${style})` }, svg("title", {}, edge.title)));
      if (edge.label) names.push(svg("text", { x: line.x, y: line.y - 4, class: `edge-text${isSlow ? " slow-text" : ""}` }, edge.label, svg("title", {}, edge.title)));
    });
    // What is written lies above all arrows.
    root.append(...names);
    for (const key of chosen) {
      const vertex = vertices.get(key);
      const box = graph.node(key);
      const [left, top] = [box.x - box.width / 2, box.y - box.height / 2];
      const shape = vertex.kind === "service" || vertex.kind === "action"
        ? svg("path", { d: `M${left + 12},${top} L${left + box.width - 12},${top} L${left + box.width},${box.y} L${left + box.width - 12},${top + box.height} L${left + 12},${top + box.height} L${left},${box.y} z`, class: `vertex ${vertex.kind}-shape` })
        : svg("rect", { x: left, y: top, width: box.width, height: box.height, rx: vertex.kind === "topic" ? box.height / 2 : 5, class: `vertex ${vertex.kind}-shape` });
      const pick = () => this.filter(vertex.label);
      root.append(svg("g", { class: "can-pick", tabindex: 0, role: "button", "aria-label": vertex.label, on: { click: pick, keydown: (event) => { if (event.key === "Enter") pick(); } } },
        shape, svg("text", { x: box.x, y: box.y + (vertex.under ? -3 : 4), class: "vertex-text" }, cut(vertex.label, 34)),
        vertex.under && svg("text", { x: box.x, y: box.y + 13, class: "under-text" }, cut(vertex.under, 34)), svg("title", {}, [vertex.label, vertex.under].filter(Boolean).join("\n"))));
    }
    return root;
  }

  leave() {}
}

function item(shape, text) {
  return h("span", { className: "legend-item" }, h("span", { className: `shape ${shape}` }), text);
}

function curve(points) {
  let path = `M${points[0].x},${points[0].y}`;
  for (let at = 1; at < points.length - 1; at++) {
    const next = points[at + 1];
    const [x, y] = at === points.length - 2 ? [next.x, next.y] : [(points[at].x + next.x) / 2, (points[at].y + next.y) / 2];
    path += ` Q${points[at].x},${points[at].y} ${x},${y}`;
  }
  if (points.length === 2) path += ` L${points[1].x},${points[1].y}`;
  return path;
}

function shortened(text, room) {
  return text.length <= room ? text : `${text.slice(0, room - 1)}…`;
}

function cut(text, room) {
  return text.length <= room ? text : `…${text.slice(text.length - room + 1)}`;
}

function model({ rates, transports, services, actions, indirect, executors, rows }) {
  const vertices = new Map();
  const groups = new Map();
  const edges = [];
  const groupOf = new Map();
  const kindsOf = new Map();
  for (let row = 0; row < executors.rows; row++) {
    const key = `executor ${executors.executor_id[row]}`;
    groups.set(key, { host: executors.host[row], text: `${executors.process[row]} on ${executors.host[row]}: ${String(executors.executor_kind[row]).replace("_", "-")}, ${count(executors.threads[row], "thread")}` });
    // A node of several executors belongs to none of them alone.
    groupOf.set(executors.node[row], groupOf.has(executors.node[row]) ? null : key);
  }
  for (let row = 0; row < indirect.rows; row++) {
    for (const topic of String(indirect.outputs[row] ?? "").split(/, */)) kindsOf.set(`${indirect.node[row]}>${topic}`, indirect.kind[row]);
  }
  const add = (kind, label, under) => {
    const key = `${kind}:${label}`;
    const known = vertices.get(key);
    if (!known) vertices.set(key, { key, kind, label, under: under ?? null, group: kind === "node" ? groupOf.get(label) ?? null : null });
    else if (under && !known.under) known.under = under;
    return key;
  };
  const rate = new Map();
  for (let row = 0; row < rates.rows; row++) {
    const topic = rates.topic_name[row] ?? "?";
    rate.set(topic, (rate.get(topic) ?? 0) + (Number.isNaN(rates.rate_hz[row]) ? 0 : rates.rate_hz[row]));
  }
  for (let row = 0; row < rates.rows; row++) {
    const topic = rates.topic_name[row] ?? "?";
    const node = rates.publisher[row];
    const kind = kindsOf.get(`${node}>${topic}`) ?? null;
    edges.push({ from: add("node", node), to: add("topic", topic, `${rate.get(topic).toLocaleString("en-US", { maximumFractionDigits: 1 })} Hz`),
      kind: "publish", indirect: kind, count: rates.count[row], label: "",
      title: `${node} published ${count(rates.count[row], "message")} on ${topic}${kind ? `, by an indirect link (${kind})` : ""}` });
  }
  for (let row = 0; row < transports.rows; row++) {
    const topic = transports.topic_name[row] ?? "?";
    const node = transports.subscriber[row];
    const known = !Number.isNaN(transports.median_ns[row]);
    edges.push({ from: add("topic", topic), to: add("node", node), kind: "receive", indirect: null, median: known ? transports.median_ns[row] : undefined, count: transports.takes[row],
      label: known ? `${brief(transports.median_ns[row])} · ${brief(transports.p95_ns[row])}` : "",
      title: `${node} received ${count(transports.takes[row], "message")} on ${topic}${known ? `: ${duration(transports.median_ns[row])} median, ${duration(transports.p95_ns[row])} p95` : ", none with a known publication"}` });
  }
  for (let row = 0; row < services.rows; row++) {
    const name = services.service_name[row] ?? "?";
    if (name.includes(OF_ACTION)) continue;
    const under = Number.isNaN(services.round_trip_median_ns[row]) ? null : `${duration(services.round_trip_median_ns[row])} median`;
    const service = add("service", name, under);
    const said = `${count(services.requests[row], "request")}${under ? `, round trip ${under}, ${duration(services.round_trip_p95_ns[row])} p95` : ""}`;
    if (services.client[row]) edges.push({ from: add("node", services.client[row]), to: service, kind: "service", count: services.requests[row], label: "", title: `${services.client[row]} called ${name}: ${said}` });
    if (services.server[row]) edges.push({ from: service, to: add("node", services.server[row]), kind: "service", count: services.requests[row], label: "", title: `${services.server[row]} serves ${name}: ${said}` });
  }
  for (let row = 0; row < actions.rows; row++) {
    const name = actions.action_name[row];
    const under = Number.isNaN(actions.result_median_ns[row]) ? null : `${duration(actions.result_median_ns[row])} median`;
    const action = add("action", name, under);
    const said = `${count(actions.goals[row], "goal")}${under ? `, to the result ${under}, ${duration(actions.result_p95_ns[row])} p95` : ""}`;
    if (actions.client[row]) edges.push({ from: add("node", actions.client[row]), to: action, kind: "service", count: actions.goals[row], label: "", title: `${actions.client[row]} sent to ${name}: ${said}` });
    if (actions.server[row]) edges.push({ from: action, to: add("node", actions.server[row]), kind: "service", count: actions.goals[row], label: "", title: `${actions.server[row]} executes ${name}: ${said}` });
  }
  const medians = edges.map((edge) => edge.median).filter((median) => median > 0).sort((a, b) => a - b);
  return { vertices, edges: merged(edges), groups, slow: medians.length ? SLOW * medians[medians.length >> 1] : Infinity,
    hosts: [...new Set([...groups.values()].map(({ host }) => host))].sort() };
}

function merged(edges) {
  const known = new Map();
  for (const edge of edges) {
    const key = `${edge.from}>${edge.to}`;
    if (known.has(key)) {
      const first = known.get(key);
      first.count += edge.count;
      if (!first.title.includes(edge.title)) first.title += `\n${edge.title}`;
    } else known.set(key, edge);
  }
  return [...known.values()];
}
