// The panel below a table: what the chosen row did over time, and its longest instances.

import { clear, h } from "./dom.js";
import { current, pageAddress, replace } from "./address.js";
import { duration, momentAxis } from "./labels.js";
import { besides, dataTable } from "./table.js";
import { chart, counted } from "./chart.js";
import { failed, waiting } from "./notice.js";
import { OF_CALLBACK } from "./course.js";

export const onTimeline = (kind, id) => pageAddress("timeline", { flow: `${kind}:${id}` });

// A field: only rows that have its text are shown in the tables of some choosers. The address keeps
// the text.
export function searchField(app, label, choosers) {
  const field = h("input", {
    type: "search",
    placeholder: `${label} …`,
    "aria-label": `show only what has this text: ${label}`,
    value: current().q ?? "",
    on: {
      input: () => {
        replace({ q: field.value });
        app.linksMoved();
        for (const chooser of choosers()) chooser.fill();
      },
    },
  });
  return field;
}

// A table whose rows open a panel below it. The address keeps the chosen row under `key`, by the
// text that `identity` returns for it.
export class Chooser {
  // Options: those of dataTable, and key, identity(table, row), panel(table, row): what is in the
  // panel; texts(table, row): what is searched.
  constructor(app, options) {
    this.app = app;
    this.options = options;
    this.order = {};
    this.list = h("div");
    this.detail = h("div", { className: "panel" });
  }

  // The section of the table, and the panel below it.
  section(title, help, ...under) {
    const soft = h("p", { className: "soft" }, help);
    return [h("section", {}, h("h2", {}, title), soft, this.list, under), this.detail];
  }

  isFound(row) {
    const text = (current().q ?? "").trim().toLowerCase();
    return !text ||
      this.options.texts(this.table, row).some((one) => one?.toLowerCase().includes(text));
  }

  show(table) {
    const { key, identity } = this.options;
    const isFirst = !this.table;
    this.table = table;
    const asked = current()[key];
    this.row = asked === undefined
      ? -1
      : Array.from({ length: table.rows }, (_, row) => identity(table, row)).indexOf(asked);
    this.fill();
    if (isFirst && this.row >= 0) this.open();
    return this;
  }

  fill() {
    clear(
      this.list,
      dataTable(this.table, {
        ...this.options,
        state: this.order,
        only: (row) => this.isFound(row),
        picked: (row) => row === this.row,
        onPick: (row) => this.pick(row),
      }),
    );
    this.list.classList.toggle("is-short", this.row >= 0);
  }

  pick(row) {
    const { key, identity } = this.options;
    this.row = row;
    replace({ [key]: identity(this.table, row) });
    this.app.linksMoved();
    this.fill();
    this.list.querySelector("[aria-selected=true]")?.scrollIntoView({ block: "nearest" });
    this.open().then(() => this.detail.scrollIntoView({ block: "nearest", behavior: "smooth" }));
  }

  async open() {
    const { row } = this;
    clear(this.detail, waiting());
    try {
      const content = await this.options.panel(this.table, row);
      if (row === this.row) clear(this.detail, content);
    } catch (error) {
      if (error.name !== "AbortError") clear(this.detail, failed(error));
    }
  }
}

// Longest and median of pieces of time; a click leads to the longest. Options: title, values and
// median (columns of points), target(row): an address, marks.
export function overTime(points, { title, values, median, target, marks }) {
  const known = (column) =>
    Array.from(points[column], (value) => (value === null || Number.isNaN(value) ? null : value));
  return h(
    "section",
    {},
    h("h3", {}, title[0].toUpperCase() + title.slice(1)),
    h(
      "p",
      { className: "soft" },
      `The longest of each ${
        duration(points.length[0])
      }, and the median. Click a point to see it on the timeline.`,
    ),
    chart(Array.from(points.start_at), [
      { label: "longest", color: "process", values: known(values), points: true },
      { label: "median", color: "timer", values: known(median), width: 1.5, isJoined: true },
    ], {
      title,
      xFormat: momentAxis,
      xName: "begin [ns since begin of run]",
      marks,
      onClick: (row) => {
        location.hash = target(row);
      },
    }),
    besides(
      "as a table",
      dataTable(points, {
        label: title,
        columns: ["start_at", "length", "count", "published", "taken", "answered", values, median],
        onPick: (row) => {
          location.hash = target(row);
        },
      }),
    ),
  );
}

// How many began in each piece of time. Series: {label, color, values}.
export function ratesOverTime(points, title, series, marks) {
  return h(
    "section",
    {},
    h("h3", {}, title[0].toUpperCase() + title.slice(1)),
    h(
      "p",
      { className: "soft" },
      `How many in each ${duration(points.length[0])}. A click shows that time on the timeline.`,
    ),
    chart(Array.from(points.start_at), series.map((one) => ({ stepped: true, ...one })), {
      title,
      xFormat: momentAxis,
      yFormat: counted,
      xName: "begin [ns since begin of run]",
      legend: true,
      marks,
      onClick: (row) => {
        const from = points.start_at[row];
        location.hash = pageAddress("timeline", { from, to: from + points.length[row] });
      },
    }),
  );
}

// The longest instances; the first of them is offered in words.
export function slowestOnes(slowest, { title, values, target, columns }) {
  if (!slowest.rows) return null;
  return h(
    "section",
    {},
    h("h3", {}, title),
    h(
      "p",
      {},
      h(
        "a",
        { className: "longest", href: target(0) },
        `the longest, ${duration(slowest[values][0])}, on the timeline`,
      ),
    ),
    dataTable(slowest, {
      columns,
      label: title,
      onPick: (row) => {
        location.hash = target(row);
      },
    }),
  );
}

// Changes below a panel, when they are known; marks for its charts, of those that `isOwn` says.
export function changesBeside(app, rowsOf, isOwn = () => true) {
  const place = h("div");
  const marks = Promise.all([app.course(), app.happened()]).then(([course, others]) => {
    const rows = rowsOf(course);
    clear(place, course.table(rows));
    return [...others, ...course.marks(rows.filter((row) => isOwn(course.changes, row)))];
  }).catch((error) => {
    if (error.name !== "AbortError") clear(place, failed(error));
    return app.happened();
  });
  return { place, marks };
}

// What a callback did, by its identity.
export async function callbackPanel(app, callback, node, label) {
  const [points, slowest] = await Promise.all(
    ["callback_point", "callback_slowest"].map((query) => app.inWindow(query, { callback })),
  );
  const head = h("h2", { className: "path-title" }, `${node ?? ""} ${label}`);
  const { place, marks } = changesBeside(app, (course) => course.of(OF_CALLBACK, label, node));
  if (!points.rows) return [head, h("p", {}, "No instance of it began in the window of time.")];
  const target = (table) => (row) =>
    onTimeline("callback_instance", table.callback_instance_id[row]);
  return [
    head,
    h(
      "div",
      { className: "charts" },
      overTime(points, {
        title: "duration over time",
        values: "duration",
        median: "median",
        target: target(points),
        marks,
      }),
      ratesOverTime(points, "instances over time", [{
        label: "instances",
        color: "timer",
        values: Array.from(points.count),
        fill: true,
      }], marks),
      slowestOnes(slowest, {
        title: "Longest instances",
        values: "duration",
        target: target(slowest),
        columns: ["start_at", "duration", "callback_instance_id"],
      }),
    ),
    place,
  ];
}
