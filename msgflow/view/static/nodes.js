// Nodes: their callbacks, timers, services and executors; how often and how long these ran and waited.

import { clear, h } from "./dom.js";
import { count } from "./labels.js";
import { besides, dataTable, filled } from "./table.js";
import { redrawCharts } from "./chart.js";
import { commands, notes } from "./notice.js";
import { callbackPanel, Chooser, searchField } from "./panel.js";
import { courseColumn, OF_CALLBACK } from "./course.js";
import { Sections } from "./sections.js";
import { timers } from "./timers.js";
import { actions, services } from "./services.js";
import { Executors } from "./executors.js";
import { functions } from "./functions.js";

const COLUMNS_OF_CALLBACKS = [
  "node",
  "callback",
  "count",
  "rate_hz",
  "median_ns",
  "p95_ns",
  "max_ns",
];
const OF_CPU = ["running_median_ns", "running_p99_ns", "cpu_share"];
const OF_WAITS = ["wait_median_ns", "wait_max_ns"];
const OF_DELIVERY = ["dropped", "lost", "reasons"];

export class NodesPage {
  constructor(app, root) {
    this.app = app;
    this.root = root;
    this.choosers = [];
    this.executors = new Executors(app);
    this.ready = this.build();
  }

  async build() {
    const { app } = this;
    const [callbacks, nodes, processes] = await Promise.all([
      app.query("callbacks"),
      app.query("info-nodes"),
      app.query("info-processes"),
    ]);
    const chooser = this.chooser(callbacks, {
      key: "callback",
      label: "callbacks",
      columns: [...COLUMNS_OF_CALLBACKS, ...filled(callbacks, OF_CPU)],
      sort: { name: "max_ns", down: true },
      identity: (table, row) => String(table.callback_id[row]),
      nothing: "No callback was recorded.",
      texts: (table, row) => [table.node[row], table.callback[row], table.symbol[row]],
      panel: (table, row) =>
        callbackPanel(app, table.callback_id[row], table.node[row], table.callback[row]),
    });
    const under = h("div", {}, notes(callbacks.meta.notes), commands([callbacks]));
    const known = new Set(callbacks.node);
    const silent = [...new Set(nodes.node)].filter((node) => !known.has(node));
    // These take longest: the page does not wait for them.
    const choose = (table, options) => this.chooser(table, options);
    const joined = this.join(chooser, under, callbacks);
    const sections = new Sections({
      Callbacks: () => [
        chooser.section(
          "Callbacks of the nodes",
          "A click on a row shows the callback over time, and leads to its longest instance.",
          silent.length > 0 && h("p", {}, `No callback of ${silent.join(", ")} was recorded.`),
          under,
          besides(
            count(nodes.rows, "node"),
            dataTable(nodes, { label: "nodes" }),
            commands([nodes]),
          ),
          besides(
            `${processes.rows} ${processes.rows === 1 ? "process" : "processes"}`,
            dataTable(processes, { label: "processes" }),
            commands([processes]),
          ),
        ),
      ],
      Timers: () => timers(app, choose),
      Services: () => services(app, choose),
      Actions: () => actions(app),
      Functions: () => functions(app),
      Executors: () => joined.then(() => this.executors.build()),
    });
    const search = searchField(app, "node, callback, service", () => this.choosers);
    clear(this.root, h("div", { className: "tools" }, search, sections.links), sections.places);
    this.complete = sections.complete;
  }

  // A table whose rows open a panel, below the field that searches all of them.
  chooser(table, options) {
    const made = new Chooser(this.app, options).show(table);
    this.choosers.push(made);
    return made;
  }

  // How long callbacks waited, and what their subscriptions missed, in columns of their own.
  async join(chooser, under, callbacks) {
    const { app } = this;
    const [waits, delivery, objects] = await Promise.all([
      app.query("waits"),
      app.query("topics-delivery"),
      app.fetch("callback"),
    ]);
    const subscription = new Map(
      Array.from(objects.callback_id, (id, row) => [id, objects.subscription_id[row]]),
    );
    const { columns } = chooser.options;
    const table = { ...callbacks };
    // Columns of another table: from the row with the same identity.
    const add = (other, names, key, identity) => {
      const place = new Map(Array.from(other[key], (id, row) => [id, row]));
      for (const name of names) {
        table[name] = Array.from(
          callbacks.callback_id,
          (id) => other[name][place.get(identity(id))] ?? null,
        );
        table.columns = [...table.columns, other.columns.find((one) => one.name === name)];
        const described = { ...table.meta.columns, [name]: other.meta.columns[name] };
        table.meta = { ...table.meta, columns: described };
        columns.push(name);
      }
    };
    add(waits, OF_WAITS, "callback_id", (id) => id);
    add(delivery, OF_DELIVERY, "subscription_id", (id) => subscription.get(id));
    const find = (row) => [OF_CALLBACK, table.callback[row], table.node[row]];
    courseColumn(app, table, find, () => {
      columns.splice(2, 0, "course");
      chooser.show(table);
    });
    const tables = [callbacks, waits, delivery];
    clear(under, notes(tables.flatMap((one) => one.meta.notes ?? [])), commands(tables));
    chooser.show(table);
  }

  recolor() {
    redrawCharts();
    this.executors.draw();
  }
  leave() {}
}
