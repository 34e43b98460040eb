// Two runs: what is longer or shorter, and the distributions of a path one over the other.

import { clear, h } from "./dom.js";
import { current, replace } from "./address.js";
import { count, duration, percent } from "./labels.js";
import { besides, dataTable } from "./table.js";
import { command, failed, notes, waiting } from "./notice.js";
import { chart, redrawCharts } from "./chart.js";

const KINDS_OF = {
  paths: "paths (end-to-end latency)",
  callbacks: "callbacks (duration)",
  topics: "topics (from publication to take)",
};
const ONE_OF = { paths: "path", callbacks: "callback", topics: "topic" };
const MEASURED = [
  "subject",
  "statistic",
  "a_ns",
  "b_ns",
  "difference_ns",
  "change_percent",
  "a_count",
  "b_count",
  "a_share",
  "b_share",
];
const COMPARED = [
  "subject",
  "statistic",
  "a_ns",
  "b_ns",
  "difference_ns",
  "change_percent",
  "low_ns",
  "high_ns",
  "verdict",
  "a_count",
  "b_count",
  "a_share",
  "b_share",
];

export class ComparePage {
  constructor(app, root) {
    this.app = app;
    this.root = root;
    this.ready = this.build();
  }

  async build() {
    const { app } = this;
    const others = app.runs.filter((run) => run !== app.run);
    if (!others.length) {
      clear(
        this.root,
        h(
          "section",
          {},
          h("h2", {}, "Compare"),
          h(
            "p",
            {},
            "There is only one run in this database: ingest another one to compare it with.",
          ),
        ),
      );
      return;
    }
    const asked = current();
    const given = others.find((run) => String(run.run_id) === asked.other);
    this.other = given ?? (await this.before(others));
    this.what = asked.what in KINDS_OF ? asked.what : "paths";
    const choice = h(
      "select",
      {
        "aria-label": "run to compare with",
        on: {
          change: () => {
            this.other = others.find((run) => String(run.run_id) === choice.value);
            this.show();
          },
        },
      },
      !this.other && h("option", { selected: true }, "choose a run"),
      others.map((run) =>
        h("option", { value: String(run.run_id), selected: run === this.other }, run.name)
      ),
    );
    const what = h(
      "select",
      {
        "aria-label": "what to compare",
        on: {
          change: () => {
            this.what = what.value;
            this.show();
          },
        },
      },
      Object.entries(KINDS_OF).map(([value, text]) =>
        h("option", { value, selected: value === this.what }, text)
      ),
    );
    const only = h("input", {
      type: "checkbox",
      checked: true,
      on: {
        change: () => {
          this.all = !only.checked;
          this.rows();
        },
      },
    });
    this.body = h("div");
    this.picture = h("div");
    clear(
      this.root,
      h(
        "section",
        {},
        h("h2", {}, "Compare"),
        h(
          "div",
          { className: "tools" },
          h("span", {}, "A:"),
          choice,
          h("span", {}, `B: ${app.run.name}`),
          what,
          h("label", {}, only, "only what differs"),
        ),
        this.body,
        this.picture,
      ),
    );
    await this.show();
  }

  // The run before, of the same system, if there is one.
  async before(others) {
    // A report has one other run.
    if (!this.app.source.isServed) return others[0];
    const { run_id: found } = await this.app.fetch("run_before");
    return others.find((run) => run.run_id === found[0]);
  }

  // What was measured first; intervals, and with them verdicts, take longer.
  async show() {
    if (!this.other) {
      clear(
        this.body,
        h("p", {}, "No earlier run is of the same system: choose the one to compare with."),
      );
      return;
    }
    replace({ page: "compare", other: this.other.run_id, what: this.what });
    this.app.linksMoved();
    this.abort?.abort();
    this.abort = new AbortController();
    const { signal } = this.abort;
    this.subject = null;
    clear(this.body, waiting("measuring both runs …"));
    clear(this.picture);
    const asked = { other: this.other.run_id, what: this.what };
    try {
      if (this.app.source.isServed) {
        this.table = await this.app.fetch("compare", { ...asked, quick: 1 }, signal);
        this.rows();
      }
      this.table = await this.app.fetch("compare", asked, signal);
      this.rows();
    } catch (error) {
      if (error.name !== "AbortError") clear(this.body, failed(error));
    }
  }

  rows() {
    const { table } = this;
    const differs = (row) =>
      ["B is longer", "B is shorter", "only in A", "only in B"].includes(table.verdict[row]);
    const changed = new Set();
    for (let row = 0; row < table.rows; row++) if (differs(row)) changed.add(table.subject[row]);
    const subjects = new Set(table.subject);
    // What changed most comes first, behind it what is in one run only.
    const most = new Map();
    for (let row = 0; row < table.rows; row++) {
      const size = differs(row) ? Math.abs(table.difference_ns[row]) || 0.5 : 0;
      most.set(table.subject[row], Math.max(most.get(table.subject[row]) ?? 0, size));
    }
    const isQuick = table.meta.is_quick;
    clear(
      this.body,
      isQuick
        ? waiting(
          `${
            count(subjects.size, ONE_OF[this.what])
          } measured; which of them differ takes confidence intervals, from resampling: these are being computed …`,
        )
        : h(
          "p",
          {},
          `${
            count(changed.size, ONE_OF[this.what])
          } of ${subjects.size} differ between ${table.meta.a} (A) and ${table.meta.b} (B): the 95 % confidence interval of B − A does not contain 0.`,
        ),
      dataTable(table, {
        label: isQuick ? "measured" : "comparison",
        only: (row) => isQuick || this.all || differs(row),
        nothing: "No difference is shown.",
        columns: isQuick ? MEASURED : COMPARED,
        once: "subject",
        order: (a, b) => most.get(table.subject[b]) - most.get(table.subject[a]) || a - b,
        onPick: this.what === "paths" ? (row) => this.overlay(table.subject[row]) : undefined,
      }),
      notes(table.meta.notes),
      command(table.meta.command),
    );
    if (this.what === "paths" && table.rows && this.subject === null) {
      // Of those that differ, as far as that is known, the one that does so most.
      const size = (row) => (differs(row) ? 1e18 : 0) + Math.abs(table.difference_ns[row] || 0);
      let most = 0;
      for (let row = 1; row < table.rows; row++) if (size(row) > size(most)) most = row;
      this.overlay(table.subject[most]);
    }
  }

  async overlay(subject) {
    this.subject = subject;
    clear(this.picture, waiting("counting flows of both runs …"));
    try {
      const sides = await Promise.all([this.other, this.app.run].map(async (run) => {
        const paths = await this.app.fetch("path", { run: run.run_id });
        const row = paths.path.indexOf(subject);
        return row < 0
          ? null
          : this.app.fetch("path_share", { run: run.run_id, path: paths.path_id[row] });
      }));
      const known = sides.filter(Boolean).filter((side) => side.rows);
      if (!known.length) {
        clear(this.picture, h("p", {}, `No flow reached the end of ${subject}.`));
        return;
      }
      const x = [...new Set(known.flatMap((side) => Array.from(side.latency)))].sort((a, b) =>
        a - b
      );
      const values = (side) => {
        if (!side?.rows) return x.map(() => null);
        let at = 0;
        return x.map((latency) => {
          while (at < side.rows && side.latency[at] <= latency) at++;
          return at ? side.share[at - 1] : 0;
        });
      };
      clear(
        this.picture,
        h("h3", { className: "path-title" }, subject),
        h("p", { className: "soft" }, "Share of the flows that took no longer, of both runs."),
        chart(x, [{
          label: `A: ${this.other.name}`,
          color: "second",
          values: values(sides[0]),
          stepped: true,
          dash: [6, 3],
          width: 2,
        }, {
          label: `B: ${this.app.run.name}`,
          color: "timer",
          values: values(sides[1]),
          stepped: true,
          width: 2,
        }], {
          xFormat: duration,
          yFormat: (value) => percent(value, 0),
          height: 300,
          title: "distributions of both runs",
          xName: "latency [ns]",
        }),
        besides(
          "as a table",
          ["A", "B"].map((
            name,
            place,
          ) => (sides[place]
            ? [h("h4", {}, name), dataTable(sides[place], { label: `distribution of ${name}` })]
            : h("p", {}, `not in ${name}`))
          ),
        ),
      );
    } catch (error) {
      clear(this.picture, failed(error));
    }
  }

  recolor() {
    redrawCharts();
  }
  leave() {
    this.abort?.abort();
  }
}
