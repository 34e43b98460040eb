// Paths: the latency of each; distribution, course over time and parts of the chosen one.

import { breakable, clear, color, h } from "./dom.js";
import { address, current, replace } from "./address.js";
import {
  count,
  duration,
  PALE,
  PART_COLORS,
  partTitle,
  PATH_HELP,
  pathText,
  percent,
  shellQuoted,
} from "./labels.js";
import { besides, dataTable } from "./table.js";
import { command, doubt, doubtHelp, failed, notes, sqlText, waiting } from "./notice.js";
import { chart, counted, redrawCharts } from "./chart.js";
import { doubted, pathNumbers } from "./overview.js";
import { pathFunctions } from "./functions.js";
import { changesBeside } from "./panel.js";
import { courseColumn } from "./course.js";

const COLUMNS = [
  "path",
  "course",
  "median_ns",
  "p95_ns",
  "p99_ns",
  "max_ns",
  "min_ns",
  "mean_ns",
  "roots",
  "reached",
  "dropped",
  "lost",
  "superseded",
  "no_output",
  "not_connected",
  "unknown",
  "cut_by_recording",
  "loss_affected",
  "ambiguous",
  "reasons",
];
// Shown only where they are not 0 or empty on every path.
const SELDOM = [
  "superseded",
  "no_output",
  "not_connected",
  "unknown",
  "cut_by_recording",
  "loss_affected",
  "ambiguous",
  "reasons",
];
const FATES = [
  ["reached", "reached the end", "good"],
  ["superseded", "superseded by a newer input", "faint"],
  ["dropped", "dropped: a queue was full", "second"],
  ["lost", "lost on the way", "error"],
  ["no_output", "no output: a node did not publish", "blocked"],
  ["not_connected", "not connected", "subscription"],
  ["unknown", "unknown: the trace does not tell", "soft"],
  ["cut_by_recording", "cut by the recording", "wait"],
];

export class PathsPage {
  constructor(app, root) {
    this.app = app;
    this.root = root;
    this.order = {};
    this.ready = this.build();
  }

  async build() {
    clear(this.root, waiting("looking for paths and their flows …"));
    const [table, paths] = await Promise.all([
      this.app.query("e2e-latency"),
      this.app.fetch("path"),
    ]);
    this.table = table;
    this.paths = paths;
    this.ids = pathNumbers(table, paths);
    this.isDoubted = doubted(table, paths, this.ids);
    if (!table.rows) {
      clear(
        this.root,
        h(
          "section",
          {},
          h("h2", {}, "Paths"),
          h("p", {}, "There are no paths: no message is known to have been taken."),
          notes(table.meta.notes),
        ),
      );
      return;
    }
    const asked = Number(current().path);
    let row = this.ids.indexOf(asked);
    if (row < 0) {
      row = 0;
      for (let other = 1; other < table.rows; other++) {
        if ((table.p99_ns[other] || -1) > (table.p99_ns[row] || -1)) row = other;
      }
    }
    this.list = h("div");
    this.detail = h("div");
    clear(
      this.root,
      h(
        "section",
        {},
        h("h2", {}, count(table.rows, "path")),
        h(
          "p",
          { className: "soft" },
          "A path is a chain of nodes and topics that messages took. A flow is what came of one message at its start; its latency goes from the callback that sent it to the end of the callback at the end of the path. "
            .concat(PATH_HELP),
        ),
        this.list,
        this.ids.some((_, other) => this.isDoubted(other)) && doubtHelp(),
        notes(table.meta.notes),
        command(table.meta.command),
      ),
      this.detail,
    );
    await this.choose(row, asked !== this.ids[row]);
    courseColumn(
      this.app,
      this.table,
      (other) => [["latency"], this.table.path[other]],
      () => this.fill(),
    );
  }

  async choose(row, isNew) {
    this.row = row;
    if (isNew) {
      replace({ page: "paths", path: this.ids[row] });
      this.app.linksMoved();
    }
    this.fill();
    clear(this.detail, waiting("counting flows …"));
    try {
      clear(this.detail, await this.picture(row));
    } catch (error) {
      clear(this.detail, failed(error));
    }
  }

  fill() {
    clear(
      this.list,
      dataTable(this.table, {
        columns: COLUMNS.filter((name) =>
          !SELDOM.includes(name) || this.table[name].some((value) => value)
        ),
        label: "paths",
        sort: { name: "p99_ns", down: true },
        state: this.order,
        picked: (other) => other === this.row,
        doubted: this.isDoubted,
        onPick: (other) => this.choose(other, true),
        data: (other) => ({ path: String(this.ids[other]) }),
      }),
    );
  }

  async picture(row) {
    const { app, table } = this;
    const path = this.ids[row];
    const begin = this.paths.topics[this.paths.path_id.indexOf(path)][0];
    const [histogram, shares, points, slowest] = await Promise.all(
      ["path_histogram", "path_share", "path_point", "path_slowest"].map((name) =>
        app.inWindow(name, { path })
      ),
    );
    const parts = h("div", {}, waiting("taking the latency apart …"));
    app.query("path-breakdown").then((breakdown) =>
      clear(parts, this.breakdown(breakdown, path, table.path[row]))
    )
      .catch((error) => clear(parts, failed(error)));
    const sampled = h("div");
    pathFunctions(app, path).then((found) => clear(sampled, found))
      .catch((error) => error.name === "AbortError" || clear(sampled, failed(error)));
    const bins = this.bins = evenBins(histogram);
    const nodes = new Set(pathText(table.path[row]).split(" → "));
    const isOwn = (changes, at) => changes.subject[at] === table.path[row];
    const { place, marks } = changesBeside(
      app,
      (course) =>
        course.rows((at) => isOwn(course.changes, at) || nodes.has(course.changes.node[at])),
      isOwn,
    );
    const toFlow = (source, at) =>
      address({
        page: "timeline",
        path: null,
        from: null,
        to: null,
        source: begin,
        flow: Number.isNaN(source.take_id[at]) || source.take_id[at] === null
          ? `${source.root_kind[at]}:${source.root_id[at]}`
          : `take:${source.take_id[at]}`,
      });
    return [
      h(
        "section",
        {},
        h("h2", { className: "path-title" }, breakable(pathText(table.path[row]))),
        this.fates(row),
      ),
      histogram.rows
        ? h(
          "div",
          { className: "charts" },
          h(
            "section",
            {},
            h("h3", {}, "Latency over time"),
            h(
              "p",
              { className: "soft" },
              points.rows && points.count.some((n) => n > 1)
                ? `The slowest flow of each of ${points.rows} pieces of time, and the median of the piece. Click a point to see its flow.`
                : "Click a point to see its flow.",
            ),
            chart(Array.from(points.root_at), pointSeries(points), {
              xFormat: (value) => `${+(value / 1e9).toFixed(6)} s`,
              title: "latency over time",
              marks,
              xName: "began at [ns since begin of run]",
              onClick: (at) => {
                location.hash = toFlow(points, at);
              },
            }),
            besides(
              "as a table",
              dataTable(points, {
                columns: ["root_at", "latency", "median", "count", "missing"],
                label: "latency over time",
                onPick: (at) => {
                  location.hash = toFlow(points, at);
                },
              }),
            ),
          ),
          h(
            "section",
            {},
            h("h3", {}, "Histogram"),
            chart(bins.low, [{
              label: "flows",
              color: "timer",
              values: bins.count,
              bars: true,
              fill: true,
            }], {
              xFormat: duration,
              yFormat: counted,
              title: "histogram of the latency",
              xName: "at least [ns]",
            }),
            besides(
              "as a table",
              dataTable(histogram, { columns: ["low", "width", "count"], label: "histogram" }),
            ),
          ),
          h(
            "section",
            {},
            h("h3", {}, "Share of the flows that took no longer"),
            chart(Array.from(shares.latency), [{
              label: "share",
              color: "timer",
              values: Array.from(shares.share),
              stepped: true,
            }], {
              xFormat: duration,
              yFormat: (value) => percent(value, 0),
              title: "distribution of the latency",
              xName: "latency [ns]",
            }),
            besides("as a table", dataTable(shares, { label: "distribution" })),
          ),
          h(
            "section",
            {},
            h("h3", {}, "Slowest flows"),
            dataTable(slowest, {
              columns: ["root_at", "latency"],
              label: "slowest flows",
              onPick: (at) => {
                location.hash = toFlow(slowest, at);
              },
            }),
          ),
        )
        : h("p", {}, "No flow reached the end of this path."),
      place,
      h("section", {}, h("h2", {}, "What the latency consists of"), parts),
      sampled,
    ];
  }

  fates(row) {
    const { table } = this;
    const total = table.roots[row];
    if (!total) return h("p", {}, "No flow began in the time shown.");
    const track = h("div", { className: "fates", role: "img", "aria-label": "completeness" });
    const legend = h("div", { className: "legend" });
    for (const [name, text, shade] of FATES) {
      const number = table[name][row];
      if (!number && SELDOM.includes(name)) continue;
      if (number) {
        const piece = h("span", { className: "fate" });
        piece.style.width = `${(100 * number) / total}%`;
        piece.style.background = color(shade);
        track.append(piece);
      }
      const swatch = h("span", { className: "swatch" });
      swatch.style.background = color(shade);
      legend.append(
        h(
          "span",
          { className: "legend-item" },
          swatch,
          `${text}: ${number.toLocaleString("en-US")} (${percent(number / total)})`,
        ),
      );
    }
    return [
      h(
        "p",
        {},
        `${count(total, "flow")} began; ${duration(table.median_ns[row])} median, ${
          duration(table.p95_ns[row])
        } p95, ${duration(table.p99_ns[row])} p99, ${duration(table.max_ns[row])} at most`,
        this.isDoubted(row) && doubt(),
        ".",
      ),
      track,
      legend,
      table.reasons[row] && h("p", { className: "soft" }, `Reasons: ${table.reasons[row]}`),
    ];
  }

  breakdown(breakdown, path, name) {
    const rows = [];
    for (let row = 0; row < breakdown.rows; row++) {
      if (breakdown.path_id[row] === path) rows.push(row);
    }
    if (!rows.length) return h("p", {}, "No flow reached the end of this path.");
    const most = Math.max(...rows.map((row) => Math.abs(breakdown.mean_ns[row])));
    const [stack, legend] = breakdownStack(breakdown, rows, this.root.clientWidth);
    return [
      h(
        "p",
        { className: "soft" },
        "The mean of each part, in the order in which a flow goes through them. Where a message waited for a callback, the trace may not tell whether it was still on the way or in the queue.",
      ),
      stack,
      legend,
      dataTable(breakdown, {
        only: (row) => breakdown.path_id[row] === path,
        label: "breakdown",
        columns: [
          "hop",
          "part",
          "node",
          "what",
          "median_ns",
          "mean_ns",
          "p95_ns",
          "max_ns",
          "share",
          "flows",
          "overlaps",
        ],
      }),
      most === 0 && h("p", {}, "All parts are zero."),
      notes(breakdown.meta.notes),
      command(`${breakdown.meta.command} --where ${shellQuoted(`path = ${sqlText(name)}`)}`),
    ];
  }

  recolor() {
    if (this.row !== undefined) {
      redrawCharts();
      this.choose(this.row, false);
    }
  }
  leave() {}
}

function pointSeries(points) {
  const several = points.count.some((number) => number > 1);
  const latency = Array.from(points.latency, (value) => (Number.isNaN(value) ? null : value));
  const series = [{
    label: several ? "slowest" : "latency",
    color: several ? "process" : "timer",
    values: latency,
    points: true,
  }];
  if (several) {
    series.push({
      label: "median",
      color: "timer",
      values: Array.from(points.median, (value) => (Number.isNaN(value) ? null : value)),
      width: 1.5,
    });
  }
  return series;
}

// The answer has only bins with flows; bars are as wide as the least distance between two, and the
// last one ends where another would begin.
function evenBins(histogram) {
  const [low, values] = [[], []];
  for (let row = 0; row < histogram.rows; row++) {
    while (low.length <= histogram.bin[row]) {
      low.push(histogram.low[0] + low.length * histogram.width[0]);
      values.push(0);
    }
    values[histogram.bin[row]] = histogram.count[row];
  }
  if (low.length) {
    low.push(low.at(-1) + histogram.width[0]);
    values.push(0);
  }
  return { low, count: values };
}

// The means of the parts of a path side by side; `whole` is as wide as the stack [ns].
export function breakdownStack(breakdown, rows, width, whole = partsOf(breakdown, rows)) {
  const stack = h("div", { className: "stack", role: "img", "aria-label": "stacked breakdown" });
  const kinds = [...new Set(rows.map((row) => breakdown.part[row]))];
  const shade = (kind) => PART_COLORS[kind] ?? "faint";
  // A piece with a duration in it is as wide as that.
  const least = Math.max(0.06, 70 / (width || 900));
  const flows = Math.max(...rows.map((row) => breakdown.flows[row]), 1);
  for (const row of rows) {
    const share = Math.max(breakdown.total_ns[row], 0) / flows / (whole || 1);
    const piece = h("span", {
      className: `piece${share > least ? "" : " thin"}${
        PALE.has(shade(breakdown.part[row])) ? " pale" : ""
      }`,
      title: `${partTitle(breakdown.part[row])} ${breakdown.what[row] ?? ""} in ${
        breakdown.node[row] ?? "?"
      }: ${duration(breakdown.mean_ns[row])} mean`,
    }, share > least ? duration(breakdown.mean_ns[row]) : "");
    piece.style.width = `${100 * share}%`;
    piece.style.background = color(shade(breakdown.part[row]));
    stack.append(piece);
  }
  const legend = h(
    "div",
    { className: "legend" },
    kinds.map((kind) => {
      const swatch = h("span", { className: "swatch" });
      swatch.style.background = color(shade(kind));
      return h("span", { className: "legend-item" }, swatch, partTitle(kind));
    }),
  );
  return [stack, legend];
}

// The mean latency of the flows of a path [ns].
export function partsOf(breakdown, rows) {
  const flows = Math.max(...rows.map((row) => breakdown.flows[row]), 1);
  return rows.reduce((sum, row) => sum + Math.max(breakdown.total_ns[row], 0), 0) / flows;
}
