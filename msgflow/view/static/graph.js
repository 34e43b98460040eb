// The graph of nodes, topics, services and actions, with rates on topics and latencies on edges.

import { clear, color, h, svg } from "./dom.js";
import { address, current, replace } from "./address.js";
import { count, duration, percent } from "./labels.js";
import { besides, dataTable } from "./table.js";
import { command, failed, notes, waiting } from "./notice.js";
import { markSlowest, model } from "./graph_model.js";
import { csvText, saveFile } from "./download.js";
import { savePng, saveSvg } from "./picture_file.js";
import { Zoom } from "./zoom.js";

// What is laid out without being asked: beyond it the layout takes longer than one waits.
const MOST_VERTICES = 260;
// A line of nodes that would become smaller than this is laid out from top to bottom.
const LEAST_SCALE = 0.8;
// Names that are longer are cut; the panel has all of them.
const LONGEST_NAME = 60;
// Of the small letters, in pixels.
const WIDTH_OF_LETTER = 6.8;
// Two lines above the nodes of an executor.
const GROUP_HEAD = 24;
// Of the edge with the most messages.
const WIDEST = 6;
// Hosts have a colour each, as far as there are some in the style sheet.
const HOSTS = 5;
const INDIRECT = {
  periodic_async: "8 4",
  partial_sync: "2 4",
  approximate_sync: "2 4",
  queue: "8 4",
};

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
    const [rates, transports, services, actions, indirect, executors, callbacks, drops] =
      await Promise.all([
        app.query("topics-rate"),
        app.query("topics-latency"),
        app.query("service-latency"),
        app.query("action-latency"),
        app.query("links"),
        app.fetch("executor_node"),
        app.query("callbacks"),
        app.query("topics-delivery"),
      ]);
    this.tables = { rates, transports, services, actions };
    this.model = model({
      rates,
      transports,
      services,
      actions,
      indirect,
      executors,
      callbacks,
      drops,
    });
    this.search = h("input", {
      type: "search",
      placeholder: "node or topic …",
      value: current().q ?? "",
      "aria-label": "only what is beside nodes and topics with this text",
      on: { change: () => this.filter(this.search.value) },
    });
    const group = h("input", {
      type: "checkbox",
      checked: true,
      on: {
        change: () => {
          this.grouped = group.checked;
          this.draw();
        },
      },
    });
    this.side = h("aside", { className: "side", hidden: true, "aria-label": "what was clicked" });
    const act = (label, text, action) =>
      h(
        "button",
        { type: "button", title: label, "aria-label": label, on: { click: action } },
        text,
      );
    this.picture = h("div", {
      className: "graph",
      tabIndex: 0,
      role: "region",
      "aria-label": "graph of nodes and topics",
    });
    this.said = h("p", { className: "status", role: "status" });
    clear(
      this.root,
      h(
        "div",
        { className: "tools" },
        this.search,
        h("button", { type: "button", on: { click: () => this.filter("") } }, "all"),
        h("label", {}, group, "group by executor"),
        h(
          "span",
          { className: "group" },
          act("Zoom in", "+", () => this.zoom.in()),
          act("Zoom out", "−", () => this.zoom.out()),
          act("Show all of it", "fit", () => this.zoom.all()),
        ),
        h(
          "span",
          { className: "group" },
          act("Save as SVG", "SVG", () => saveSvg(this.drawing, "graph")),
          act("Save as PNG", "PNG", () => this.save()),
          act("Save as CSV", "CSV", () => this.saveNumbers()),
        ),
      ),
      this.said,
      h("div", { className: "stage" }, this.picture, this.side),
      h(
        "div",
        { className: "legend" },
        item("box", "node"),
        item("pill", "topic, with its rate"),
        item("diamond", "service, with its round trip"),
        actions.rows > 0 && item("action", "action, with the time from a goal to its result"),
        h(
          "span",
          { className: "legend-item" },
          h("span", { className: "stroke color-transport" }),
          "published, received: median · p95 from publication to take",
        ),
        h(
          "span",
          { className: "legend-item" },
          h("span", { className: "stroke dashed color-indirect" }),
          "published by an indirect link",
        ),
        h(
          "span",
          { className: "legend-item" },
          "the wider an arrow, the more messages; the stronger the colour of a node, the longer its callbacks ran",
        ),
        this.model.edges.some((edge) => edge.missing) &&
          h(
            "span",
            { className: "legend-item" },
            h("span", { className: "stroke color-error" }),
            "messages dropped or lost",
          ),
        h(
          "span",
          { className: "legend-item" },
          h("span", { className: "shape box slowest" }),
          "part of the slowest flow, with its share",
        ),
        this.model.hosts.length > 1 && this.model.hosts.map((host, place) =>
          h(
            "span",
            { className: "legend-item" },
            h("span", { className: `swatch host-mark host-${place % HOSTS}` }),
            `on ${host}`,
          )
        ),
      ),
      besides(
        "topics and their publishers as a table",
        dataTable(rates, { label: "publication rates" }),
        command(rates.meta.command),
      ),
      besides(
        "receivers and their latencies as a table",
        dataTable(transports, { label: "latencies from publication to take" }),
        notes(transports.meta.notes),
        command(transports.meta.command),
      ),
      services.rows
        ? besides(
          "services as a table",
          dataTable(services, { label: "services" }),
          command(services.meta.command),
        )
        : null,
      actions.rows
        ? besides(
          "actions as a table",
          dataTable(actions, { label: "actions" }),
          command(actions.meta.command),
        )
        : null,
    );
    this.zoom = new Zoom(this.picture);
    this.draw();
    this.slowest();
  }

  // What takes longest comes when it is known.
  async slowest() {
    try {
      const blame = await this.app.fetch("summary", { part: "blame" });
      if (this.app.page === this && markSlowest(this.model.vertices, blame)) this.draw();
    } catch (error) {
      if (error.name !== "AbortError") clear(this.said, failed(error));
    }
  }

  async save() {
    try {
      await savePng(this.drawing, "graph");
    } catch (error) {
      clear(this.said, failed(error));
    }
  }

  saveNumbers() {
    const { edges, vertices } = this.model;
    const columns = {
      from: (edge) => vertices.get(edge.from).label,
      to: (edge) => vertices.get(edge.to).label,
      kind: (edge) => edge.kind,
      indirect: (edge) => edge.indirect,
      count: (edge) => edge.count,
      median_ns: (edge) => edge.median,
    };
    saveFile(
      new Blob([
        csvText(Object.entries(columns).map(([title, value]) => [title, edges.map(value)])),
      ], { type: "text/csv" }),
      "graph.csv",
    );
  }

  // What goes in and out of a vertex; the graph stays as it is.
  show(vertex) {
    const { edges, vertices } = this.model;
    const list = (title, found, end) =>
      found.length > 0 &&
      [
        h("h3", {}, title),
        h(
          "ul",
          {},
          found.map((edge) =>
            h(
              "li",
              {},
              h("button", {
                type: "button",
                className: "pick",
                on: { click: () => this.show(vertices.get(edge[end])) },
              }, vertices.get(edge[end]).label),
              edge.title.split("\n").map((line) => h("div", { className: "soft" }, line)),
            )
          ),
        ),
      ];
    this.side.hidden = false;
    clear(
      this.side,
      h(
        "div",
        { className: "side-head" },
        h("h2", { className: "path-title" }, vertex.label),
        h("button", {
          type: "button",
          "aria-label": "close",
          on: { click: () => this.closeSide() },
        }, "✕"),
      ),
      h(
        "p",
        { className: "soft" },
        [
          vertex.kind,
          vertex.under,
          vertex.group && this.model.groups.get(vertex.group).lines.join(": "),
        ].filter(Boolean).join(" · "),
      ),
      vertex.busy > 0 && h("p", {}, `Callbacks ran for ${duration(vertex.busy)} in all.`),
      vertex.slowest > 0 &&
        h("p", { className: "warn" }, `${percent(vertex.slowest)} of the slowest flow.`),
      list("in", edges.filter((edge) => edge.to === vertex.key), "from"),
      list("out", edges.filter((edge) => edge.from === vertex.key), "to"),
      h(
        "p",
        {},
        h(
          "button",
          { type: "button", on: { click: () => this.filter(vertex.label) } },
          "only what is beside it",
        ),
      ),
    );
    this.zoom.refit();
    for (const one of this.picture.querySelectorAll("g.is-picked")) {
      one.classList.remove("is-picked");
    }
    this.picture.querySelector(`g[data-key="${CSS.escape(vertex.key)}"]`)?.classList.add(
      "is-picked",
    );
  }

  closeSide() {
    this.side.hidden = true;
    this.zoom.refit();
    for (const one of this.picture.querySelectorAll("g.is-picked")) {
      one.classList.remove("is-picked");
    }
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
      const hit = [...vertices.values()].filter((vertex) =>
        vertex.label.toLowerCase().includes(text)
      ).map((vertex) => vertex.key);
      chosen = new Set(hit);
      for (const edge of edges) {
        if (hit.includes(edge.from) || hit.includes(edge.to)) {
          chosen.add(edge.from);
          chosen.add(edge.to);
        }
      }
    }
    const all = chosen.size;
    let note = text
      ? `${all} of ${vertices.size} nodes, topics, services and actions: those with “${text}” and what is beside them.`
      : `${all} nodes, topics, services and actions. Click one to see what is beside it.`;
    if (all > MOST_VERTICES && !this.everything) {
      const weight = new Map();
      for (const edge of edges) {
        for (const end of [edge.from, edge.to]) {
          weight.set(end, (weight.get(end) ?? 0) + edge.count);
        }
      }
      chosen = new Set(
        [...chosen].sort((a, b) => (weight.get(b) ?? 0) - (weight.get(a) ?? 0)).slice(
          0,
          MOST_VERTICES,
        ),
      );
      note =
        `${MOST_VERTICES} of ${all} nodes, topics, services and actions, those with the most messages: search for others. `;
    }
    clear(
      this.said,
      note,
      all > MOST_VERTICES && !this.everything && h("button", {
        type: "button",
        on: {
          click: () => {
            this.everything = true;
            this.draw();
          },
        },
      }, "draw all of them, which takes long"),
    );
    if (!chosen.size) {
      clear(
        this.picture,
        h(
          "p",
          { className: "nothing" },
          vertices.size
            ? "Nothing has this in its name."
            : "There are no nodes that publish, receive, or call.",
        ),
      );
      return;
    }
    try {
      this.drawing = this.layout(
        chosen,
        edges.filter((edge) => chosen.has(edge.from) && chosen.has(edge.to)),
      );
      clear(this.picture, this.drawing);
      this.zoom.fit(this.drawing);
    } catch (error) {
      clear(this.picture, failed(error));
    }
  }

  layout(chosen, edges) {
    const room = this.picture.clientWidth || 900;
    let graph = this.place(chosen, edges, room < 700 ? "TB" : "LR");
    // Long chains are read from the top where a line of them would become too small.
    if (room >= 700 && (room - 4) / graph.graph().width < LEAST_SCALE) {
      graph = this.place(chosen, edges, "TB");
    }
    return this.paint(graph, chosen, edges);
  }

  place(chosen, edges, direction) {
    const dagre = globalThis.dagre;
    const graph = new dagre.graphlib.Graph({ compound: true, multigraph: true });
    graph.setGraph({
      rankdir: direction,
      nodesep: this.grouped ? 34 : 16,
      ranksep: direction === "TB" ? 22 + (this.grouped ? GROUP_HEAD : 0) : 34,
      edgesep: 10,
      marginx: 14,
      marginy: GROUP_HEAD + 6,
    });
    graph.setDefaultEdgeLabel(() => ({}));
    for (const key of chosen) {
      const vertex = this.model.vertices.get(key);
      // What stands above a group has room over each of its nodes.
      const above = this.grouped && vertex.group ? this.model.groups.get(vertex.group).lines : [];
      const wide = Math.max(
        ...above.map((line) => Math.min(line.length, LONGEST_NAME) * 6.8 - 26),
        ...[vertex.label, vertex.under, vertex.slowest > 0 && "100.0 % of the slowest flow"].filter(
          Boolean,
        ).map((text) => Math.min(text.length, LONGEST_NAME) * 7.6),
      ) + 26;
      graph.setNode(key, {
        width: Math.max(wide, 60),
        height: vertex.under || vertex.slowest > 0 ? 40 : 28,
      });
      if (this.grouped && vertex.group) {
        graph.setNode(vertex.group, {});
        graph.setParent(key, vertex.group);
      }
    }
    edges.forEach((edge, place) =>
      graph.setEdge(edge.from, edge.to, {
        width: edge.label ? Math.max(labelOf(edge).length * WIDTH_OF_LETTER + 16, 122) : 0,
        height: edge.label ? 14 : 0,
        labelpos: "c",
      }, String(place))
    );
    dagre.layout(graph);
    return graph;
  }

  paint(graph, chosen, edges) {
    const { vertices, groups, hosts } = this.model;
    const used = new Set(
      [...chosen].map((key) => vertices.get(key).group).filter((group) => this.grouped && group),
    );
    const { width, height } = graph.graph();
    const most = Math.max(1, ...edges.map((edge) => edge.count || 0));
    const root = svg("svg", {
      viewBox: `0 0 ${Math.ceil(width)} ${Math.ceil(height)}`,
      role: "img",
      "aria-label": "graph of nodes and topics",
    });
    root.append(
      svg(
        "defs",
        {},
        ["transport", "indirect", "service", "missing"].map((name) =>
          svg("marker", {
            id: `tip-${name}`,
            viewBox: "0 0 8 8",
            refX: 7,
            refY: 4,
            markerWidth: 9,
            markerHeight: 9,
            markerUnits: "userSpaceOnUse",
            orient: "auto",
          }, svg("path", { d: "M0,0 L8,4 L0,8 z", class: `fill-${name}` }))
        ),
      ),
    );
    const names = [];
    // Behind what is written lies its ground, so that no line goes through it.
    const write = (x, y, name, text, title, host = null) => {
      const width = text.length * WIDTH_OF_LETTER + 6;
      const left = host === null ? x - width / 2 : x - 3;
      names.push(
        svg("rect", { x: left, y: y - 11, width, height: 15, class: `ground ${host ?? ""}` }),
        svg("text", { x, y, class: name }, text, svg("title", {}, title)),
      );
    };
    for (const key of used) {
      const box = graph.node(key);
      const { host: name, lines } = groups.get(key);
      const host = `host-${hosts.indexOf(name) % HOSTS}`;
      root.append(
        svg("rect", {
          x: box.x - box.width / 2,
          y: box.y - box.height / 2 - GROUP_HEAD,
          width: box.width,
          height: box.height + GROUP_HEAD,
          rx: 8,
          class: `group-box ${host}`,
        }),
      );
      lines.forEach((line, place) =>
        write(
          box.x - box.width / 2 + 8,
          box.y - box.height / 2 - 10 + 14 * place,
          "group-text",
          cut(line, LONGEST_NAME),
          lines.join(": "),
          host,
        )
      );
    }
    edges.forEach((edge, place) => {
      const line = graph.edge(edge.from, edge.to, String(place));
      const style = edge.missing
        ? "missing"
        : edge.indirect
        ? "indirect"
        : edge.kind === "service"
        ? "service"
        : "transport";
      const arrow = svg("path", {
        d: curve(line.points),
        class: `edge stroke-${style}`,
        "stroke-dasharray": INDIRECT[edge.indirect] ?? null,
        "marker-end": `url(#tip-${style})`,
      }, svg("title", {}, edge.title));
      arrow.style.strokeWidth = `${1 + (WIDEST - 1) * Math.sqrt((edge.count || 0) / most)}px`;
      root.append(arrow);
      if (edge.label) {
        write(
          line.x,
          line.y - 4,
          `edge-text${edge.missing ? " missing-text" : ""}`,
          labelOf(edge),
          edge.title,
        );
      }
    });
    // What is written lies above all arrows.
    root.append(...names);
    for (const key of chosen) {
      const vertex = vertices.get(key);
      const box = graph.node(key);
      const [left, top] = [box.x - box.width / 2, box.y - box.height / 2];
      const shape = vertex.kind === "service" || vertex.kind === "action"
        ? svg("path", {
          d: `M${left + 12},${top} L${left + box.width - 12},${top} L${
            left + box.width
          },${box.y} L${left + box.width - 12},${top + box.height} L${left + 12},${
            top + box.height
          } L${left},${box.y} z`,
          class: `vertex ${vertex.kind}-shape`,
        })
        : svg("rect", {
          x: left,
          y: top,
          width: box.width,
          height: box.height,
          rx: vertex.kind === "topic" ? box.height / 2 : 5,
          class: `vertex ${vertex.kind}-shape`,
        });
      if (vertex.kind === "node") {
        shape.style.setProperty("--heat", `${Math.round(10 + 55 * vertex.heat)}%`);
      }
      if (vertex.slowest > 0) shape.classList.add("slowest");
      const under = vertex.slowest > 0
        ? `${percent(vertex.slowest)} of the slowest flow`
        : vertex.under;
      const pick = () => this.show(vertex);
      root.append(
        svg(
          "g",
          {
            class: "can-pick",
            "data-key": vertex.key,
            tabindex: 0,
            role: "button",
            "aria-label": vertex.label,
            on: {
              click: pick,
              keydown: (event) => {
                if (event.key === "Enter") pick();
              },
            },
          },
          shape,
          svg(
            "text",
            { x: box.x, y: box.y + (under ? -3 : 4), class: "vertex-text" },
            cut(vertex.label, LONGEST_NAME),
          ),
          under &&
            svg("text", { x: box.x, y: box.y + 13, class: "under-text" }, cut(under, LONGEST_NAME)),
          svg("title", {}, [vertex.label, under].filter(Boolean).join("\n")),
        ),
      );
    }
    return root;
  }

  leave() {}
}

function item(shape, text) {
  return h("span", { className: "legend-item" }, h("span", { className: `shape ${shape}` }), text);
}

function labelOf({ label, missing }) {
  return missing ? `${label} ✕${missing.toLocaleString("en-US")}` : label;
}

function curve(points) {
  let path = `M${points[0].x},${points[0].y}`;
  for (let at = 1; at < points.length - 1; at++) {
    const next = points[at + 1];
    const [x, y] = at === points.length - 2
      ? [next.x, next.y]
      : [(points[at].x + next.x) / 2, (points[at].y + next.y) / 2];
    path += ` Q${points[at].x},${points[at].y} ${x},${y}`;
  }
  if (points.length === 2) path += ` L${points[1].x},${points[1].y}`;
  return path;
}

function cut(text, room) {
  return text.length <= room ? text : `…${text.slice(text.length - room + 1)}`;
}
