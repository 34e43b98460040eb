// Nodes: their callbacks, how often and how long these ran, how long they waited, what they missed.

import { clear, h } from "./dom.js";
import { count } from "./labels.js";
import { besides, dataTable } from "./table.js";
import { commands, failed, notes, waiting } from "./notice.js";
import { callbackPanel, Chooser } from "./panel.js";

const COLUMNS_OF_CALLBACKS = [
  "node",
  "callback",
  "count",
  "rate_hz",
  "median_ns",
  "p95_ns",
  "max_ns",
];
const OF_WAITS = ["wait_median_ns", "wait_max_ns"];
const OF_DELIVERY = ["dropped", "lost", "reasons"];

export class NodesPage {
  constructor(app, root) {
    this.app = app;
    this.root = root;
    this.ready = this.build();
  }

  async build() {
    const { app } = this;
    const [callbacks, nodes, objects] = await Promise.all([
      app.query("callbacks"),
      app.query("info-nodes"),
      app.fetch("callback"),
    ]);
    this.chooser = new Chooser(app, {
      key: "callback",
      label: "callbacks",
      sort: { name: "max_ns", down: true },
      identity: (table, row) => String(table.callback_id[row]),
      nothing: "No callback ran.",
      search: {
        placeholder: "node, callback …",
        label: "show callbacks with this text",
        texts: (table, row) => [table.node[row], table.callback[row], table.symbol[row]],
      },
      panel: (table, row) =>
        callbackPanel(
          app,
          table.callback_id[row],
          `${table.node[row] ?? ""} ${table.callback[row]}`,
        ),
    });
    this.under = h("div");
    this.later = h("div", {}, waiting("looking for what callbacks waited for …"));
    this.table = { ...callbacks };
    this.columns = [...COLUMNS_OF_CALLBACKS];
    const silent = this.silent(callbacks, nodes);
    clear(
      this.root,
      h(
        "section",
        {},
        h("h2", {}, "Callbacks of the nodes"),
        h(
          "p",
          { className: "soft" },
          "A click on a row shows the callback over time, and leads to its longest instance.",
        ),
        h("div", { className: "tools" }, this.chooser.search),
        this.chooser.list,
        this.later,
        this.under,
      ),
      this.chooser.detail,
      h(
        "section",
        {},
        silent.length > 0 && h("p", {}, `No callback ran of ${silent.join(", ")}.`),
        besides(count(nodes.rows, "node"), dataTable(nodes, { label: "nodes" }), commands([nodes])),
      ),
    );
    this.show();
    this.said([callbacks]);
    // These take longest: the page does not wait for them.
    this.more = this.join(callbacks, objects);
  }

  show() {
    this.chooser.options.columns = this.columns;
    this.chooser.show(this.table);
  }

  said(tables) {
    clear(
      this.under,
      notes([...new Set(tables.flatMap((table) => table.meta.notes ?? []))]),
      commands(tables),
    );
  }

  // Nodes without a row above.
  silent(callbacks, nodes) {
    const known = new Set(callbacks.node);
    return [...new Set(nodes.node)].filter((node) => !known.has(node));
  }

  async join(callbacks, objects) {
    const { app } = this;
    try {
      const [waits, delivery] = await Promise.all([
        app.query("waits"),
        app.query("topics-delivery"),
      ]);
      const subscription = new Map(
        Array.from(
          objects.callback_id,
          (callback, row) => [callback, objects.subscription_id[row]],
        ),
      );
      this.add(waits, OF_WAITS, "callback_id", (row) => callbacks.callback_id[row]);
      this.add(
        delivery,
        OF_DELIVERY,
        "subscription_id",
        (row) => subscription.get(callbacks.callback_id[row]),
      );
      clear(this.later);
      this.said([callbacks, waits, delivery]);
      this.show();
    } catch (error) {
      if (error.name !== "AbortError") clear(this.later, failed(error));
    }
  }

  // Columns of another table, beside those at hand: from the row with the same identity.
  add(other, names, key, identity) {
    const place = new Map(Array.from(other[key], (id, row) => [id, row]));
    const { table } = this;
    for (const name of names) {
      const column = other.columns.find((one) => one.name === name);
      table[name] = Array.from({ length: table.rows }, (_, row) => {
        const at = place.get(identity(row));
        return at === undefined ? null : other[name][at];
      });
      table.columns = [...table.columns, column];
      table.meta = {
        ...table.meta,
        columns: { ...table.meta.columns, [name]: other.meta.columns[name] },
      };
      this.columns.push(name);
    }
  }

  recolor() {
    this.chooser?.recolor();
  }
  leave() {}
}
