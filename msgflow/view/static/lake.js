// A lake: paths of many runs by label over time, runs that stand out, slowest flows, failures.

import { breakable, clear, h } from "./dom.js";
import { current, replace } from "./address.js";
import { count, duration, PATH_HELP, pathText, shellQuoted } from "./labels.js";
import { besides, dataTable } from "./table.js";
import { command } from "./notice.js";
import { chart, redrawCharts } from "./chart.js";

const SHADES = ["timer", "publication", "take", "service", "process", "call"];
const OTHERS = "faint";
const WITHOUT = "(none)";
// Of an axis of time, seconds: so that days begin at midnight, UTC.
const DAY = 86400;
const STEPS = [
  1,
  5,
  15,
  60,
  300,
  900,
  3600,
  7200,
  21600,
  43200,
  DAY,
  2 * DAY,
  7 * DAY,
  14 * DAY,
  28 * DAY,
  91 * DAY,
  364 * DAY,
];
const PATH_COLUMNS = [
  "path",
  "median_ns",
  "p95_ns",
  "p99_ns",
  "max_ns",
  "runs",
  "roots",
  "reached",
  "dropped",
  "lost",
  "superseded",
];

export class LakePage {
  constructor(app, root) {
    this.app = app;
    this.root = root;
    this.ready = this.build();
  }

  async build() {
    const names = ["run", "point", "outlier", "worst", "path", "finding", "failure"];
    const tables = await Promise.all(names.map((name) => this.app.fetch(`page_${name}`)));
    names.forEach((name, place) => {
      this[name] = tables[place];
    });
    this.runs = new Map(Array.from(this.run.run, (key, row) => [key, row]));
    this.labelsOf = this.run.labels.map((texts) =>
      new Map((texts ?? []).map((text) => {
        const at = text.indexOf("=");
        return [text.slice(0, at), text.slice(at + 1)];
      }))
    );
    this.labels = this.app.source.head.labels;
    const asked = current();
    this.label = this.labels.includes(asked.label) ? asked.label : this.usualLabel();
    this.list = h("div");
    this.detail = h("div");
    clear(
      this.root,
      this.facts(),
      this.paths(),
      this.detail,
      this.outliers(),
      this.findings(),
      this.failures(),
      this.allRuns(),
    );
    if (this.path.rows) {
      const row = this.path.path.indexOf(asked.path);
      await this.choose(row < 0 ? this.slowest() : row);
    }
  }

  // The label that people ask for first, else one that tells few groups apart.
  usualLabel() {
    const sizes = this.labels.map((
      label,
    ) => [label, new Set(this.labelsOf.map((known) => known.get(label))).size]);
    const some = sizes.filter(([, size]) => size > 1).sort((a, b) => a[1] - b[1]);
    return this.labels.find((label) => /version/i.test(label)) ?? some[0]?.[0] ?? this.labels[0] ??
      null;
  }

  slowest() {
    let row = 0;
    for (let other = 1; other < this.path.rows; other++) {
      if ((this.path.p99_ns[other] || -1) > (this.path.p99_ns[row] || -1)) row = other;
    }
    return row;
  }

  facts() {
    const { run } = this;
    const facts = h("dl", { className: "facts" });
    const fact = (name, value) => facts.append(h("div", {}, h("dt", {}, name), h("dd", {}, value)));
    fact("runs", run.rows.toLocaleString("en-US"));
    const began = run.began.filter(Boolean);
    if (began.length) {
      fact("recorded", `${began[0].slice(0, 16)} to ${began.at(-1).slice(0, 16)} UTC`);
    }
    fact(
      "events",
      Array.from(run.event_count).reduce((sum, n) => sum + (n || 0), 0).toLocaleString("en-US"),
    );
    fact("recordings that did not go in", this.failure.rows.toLocaleString("en-US"));
    return h(
      "section",
      {},
      h("h2", {}, "Runs of a lake"),
      facts,
      h("p", { className: "soft" }, breakable(this.app.source.head.lake)),
    );
  }

  paths() {
    if (!this.path.rows) {
      return h(
        "section",
        {},
        h("h2", {}, "Paths"),
        h("p", {}, "There are no paths: no message is known to have been taken."),
      );
    }
    return h(
      "section",
      {},
      h("h2", {}, count(this.path.rows, "path")),
      h(
        "p",
        { className: "soft" },
        `Latencies of the flows of all runs together. ${PATH_HELP} Choose a path to see it by label over time.`,
      ),
      this.list,
      command(this.path.meta.command),
    );
  }

  async choose(row) {
    this.row = row;
    replace({ page: "lake", path: this.path.path[row], label: this.label });
    clear(
      this.list,
      dataTable(this.path, {
        columns: PATH_COLUMNS,
        label: "paths",
        sort: { name: "p99_ns", down: true },
        picked: (other) => other === row,
        onPick: (other) => this.choose(other),
      }),
    );
    clear(this.detail, await this.picture(this.path.path[row]));
  }

  value(run) {
    return this.label === null
      ? WITHOUT
      : this.labelsOf[this.runs.get(run)].get(this.label) ?? WITHOUT;
  }

  async picture(path) {
    const { point, run } = this;
    const rows = Array.from({ length: point.rows }, (_, row) => row)
      .filter((row) => point.path[row] === path && !Number.isNaN(point.median_ns[row]));
    const x = rows.map((row) => run.start_s[this.runs.get(point.run[row])]);
    const values = rows.map((row) => this.value(point.run[row]));
    const numbers = new Map();
    for (const value of values) numbers.set(value, (numbers.get(value) ?? 0) + 1);
    const most = [...numbers.keys()].sort((a, b) => numbers.get(b) - numbers.get(a)).slice(
      0,
      SHADES.length,
    ).sort((a, b) => a.localeCompare(b));
    const shade = (value) => SHADES[most.indexOf(value)] ?? OTHERS;
    const shown = [...most, ...(numbers.size > most.length ? [null] : [])];
    const of = (name) =>
      shown.map((value) => ({
        label: "runs",
        color: value === null ? OTHERS : shade(value),
        points: true,
        values: rows.map((
          row,
          place,
        ) => ((value === null ? !most.includes(values[place]) : values[place] === value)
          ? point[name][row]
          : null)
        ),
      }));
    const picked = h("p", { className: "status", role: "status" });
    const pick = (at) =>
      clear(
        picked,
        this.runText(point.run[rows[at]]),
        ` – ${duration(point.median_ns[rows[at]])} median, ${duration(point.p99_ns[rows[at]])} p99`,
      );
    const span = x.length ? x.at(-1) - x[0] : 0;
    const legend = h(
      "div",
      { className: "legend" },
      this.label !== null && h("span", {}, `${this.label}:`),
      shown.map((value) =>
        h(
          "span",
          { className: "legend-item" },
          h("span", { className: `swatch color-${value === null ? "soft" : shade(value)}` }),
          value === null ? "others" : `${value} (${numbers.get(value)})`,
        )
      ),
    );
    const picture = (title, name) =>
      h(
        "section",
        {},
        h("h3", {}, title),
        chart(x, of(name), {
          xFormat: (at) => day(at, span),
          title,
          onClick: pick,
          legend: false,
          xAxis: { incrs: STEPS, space: 90 },
        }),
      );
    const table = {
      rows: rows.length,
      meta: point.meta,
      columns: [
        { name: "began", type: "text" },
        { name: "run", type: "text" },
        { name: "label", type: "text" },
        ...point.columns.filter(({ name }) => name !== "path" && name !== "run"),
      ],
    };
    for (const { name } of point.columns) table[name] = rows.map((row) => point[name][row]);
    table.began = table.run.map((key) => run.began[this.runs.get(key)]);
    table.label = values;
    table.run = table.run.map((key) => this.runName(key));
    return [
      h(
        "section",
        {},
        h("h2", { className: "path-title" }, breakable(pathText(path))),
        this.labels.length
          ? h(
            "label",
            {},
            "by ",
            h(
              "select",
              {
                "aria-label": "label",
                on: {
                  change: (event) => {
                    this.label = event.target.value;
                    this.choose(this.row);
                  },
                },
              },
              this.labels.map((label) =>
                h("option", { value: label, selected: label === this.label }, label)
              ),
            ),
          )
          : h("p", { className: "soft" }, "The runs have no labels."),
      ),
      rows.length
        ? [
          h(
            "p",
            { className: "soft" },
            "Every point is a run, at the time when it began (UTC). Click one to see which.",
          ),
          legend,
          h(
            "div",
            { className: "charts" },
            picture("Median latency of each run", "median_ns"),
            picture("99 % of the flows of each run took no longer than", "p99_ns"),
          ),
          picked,
          besides("as a table", dataTable(table, { label: "runs over time" })),
        ]
        : h("p", {}, "No flow reached the end of this path."),
      await this.groups(path),
      h("section", {}, h("h3", {}, "Slowest flows"), this.flows(path)),
    ];
  }

  async groups(path) {
    if (this.label === null) return null;
    const groups = await this.app.fetch("page_group", { label: this.label });
    const meaning = {
      ...groups,
      value: Array.from(groups.value, (value) => value ?? WITHOUT),
      meta: { ...groups.meta, columns: { value: `Value of ${this.label}` } },
    };
    return h(
      "section",
      {},
      h("h3", {}, `By ${this.label}`),
      h("p", { className: "soft" }, "Latencies of all flows of the runs with this value."),
      dataTable(meaning, {
        columns: ["value", ...PATH_COLUMNS.slice(1)],
        label: "by label",
        only: (row) => groups.path[row] === path,
      }),
      command(groups.meta.command),
    );
  }

  flows(path) {
    const { worst } = this;
    const table = {
      ...worst,
      columns: [...worst.columns, { name: "labels", type: "json" }, {
        name: "to_open_it",
        type: "text",
      }],
    };
    table.to_open_it = worst.run.map((
      key,
      row,
    ) => (this.run.has_database[this.runs.get(key)]
      ? `${this.opening(key)} && msgflow flow --db ${shellQuoted(`${key}.duckdb`)} ${
        shellQuoted(`--${worst.root_kind[row].replace("_", "-")}`)
      } ${worst.root_id[row]}`
      : "")
    );
    table.labels = worst.run.map((key) => this.run.labels[this.runs.get(key)]);
    table.run = worst.run.map((key) => this.runName(key));
    return dataTable(table, {
      columns: ["latency_ns", "run", "labels", "at_ns", "to_open_it"],
      label: "slowest flows",
      only: (row) => worst.path[row] === path,
    });
  }

  opening(key) {
    return `msgflow fleet open ${shellQuoted(key)} ${this.app.source.head.open}`;
  }

  // Names of runs come from their sources: two may have the same.
  runName(key) {
    const name = this.run.name[this.runs.get(key)];
    this.named ??= this.run.name.reduce(
      (all, each) => all.set(each, (all.get(each) ?? 0) + 1),
      new Map(),
    );
    return name && this.named.get(name) === 1 ? name : `${name ?? ""} (${key})`;
  }

  runText(key) {
    const row = this.runs.get(key);
    return [
      h("b", {}, this.run.name[row] ?? key),
      ` ${(this.run.labels[row] ?? []).join(", ")} – ${this.run.began[row]} UTC`,
      this.run.has_database[row] && [" – ", h("code", {}, this.opening(key))],
    ];
  }

  outliers() {
    const { outlier } = this;
    const table = {
      ...outlier,
      columns: [
        { name: "run", type: "text" },
        { name: "labels", type: "json" },
        ...outlier.columns.filter(({ name }) => name !== "run"),
      ],
    };
    table.labels = outlier.run.map((key) => this.run.labels[this.runs.get(key)]);
    table.run = outlier.run.map((key) => this.runName(key));
    return h(
      "section",
      {},
      h("h2", {}, "Runs that stand out"),
      h(
        "p",
        { className: "soft" },
        "Their median is far from that of the other runs on the same path: five times further than usual, and by a twentieth at least.",
      ),
      dataTable(table, { label: "runs that stand out", shown: 12, nothing: "no run stands out" }),
    );
  }

  findings() {
    const { finding } = this;
    return h(
      "section",
      {},
      h("h2", {}, "What is wrong with recordings"),
      finding.rows
        ? dataTable(finding, {
          columns: ["title", "severity", "runs", "count", "worst_run", "subject", "cure"],
          label: "findings",
        })
        : h("p", {}, "Nothing is wrong with them."),
      command(finding.meta.command),
    );
  }

  failures() {
    const { failure } = this;
    return h(
      "section",
      {},
      h("h2", {}, "Recordings that did not go in"),
      failure.rows
        ? dataTable(failure, {
          columns: ["source", "reason", "failed", "error", "hint", "labels", "stage", "tries"],
          label: "failures",
        })
        : h("p", {}, "All of them did."),
      command(failure.meta.command),
    );
  }

  allRuns() {
    const columns = ["began", "name", "labels", "event_count", "source", "run"];
    return h(
      "section",
      {},
      h("h2", {}, "All runs"),
      besides(count(this.run.rows, "run"), dataTable(this.run, { columns, label: "runs" })),
    );
  }

  recolor() {
    redrawCharts();
  }

  leave() {}
}

// A moment of a long time is a day, of a short one a time of day.
function day(seconds, span) {
  const date = new Date(seconds * 1000);
  if (Number.isNaN(date.getTime())) return "";
  const text = date.toISOString();
  if (span > 3 * DAY) return text.slice(0, 10);
  return span > 300 ? text.slice(5, 16).replace("T", " ") : text.slice(11, 19);
}
