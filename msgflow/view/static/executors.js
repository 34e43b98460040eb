// Executors: what their threads did over time, and who kept whom waiting.

import { color, h } from "./dom.js";
import { duration, percent } from "./labels.js";
import { pageAddress } from "./address.js";
import { chart } from "./chart.js";
import { SERIES_COLORS } from "./figures.js";
import { besides, dataTable, filled } from "./table.js";
import { downloads } from "./download.js";
import { command, notes } from "./notice.js";

// What a thread did, its colour, and what it is called.
const ACTIVITIES = [
  ["callback", "execute", "takes and callbacks"],
  ["blocked", "blocked", "blocked: waits for the lock of the executor"],
  ["select", "process", "select: looks for what is ready"],
  ["wait", "wait", "wait: for work"],
];

const OF_THREADS = [
  "host",
  "nodes",
  "process",
  "pid",
  "tid",
  "executor_kind",
  "seen_ns",
  "wait_ns",
  "select_ns",
  "take_ns",
  "callback_ns",
  "blocked_ns",
  "unknown_ns",
  "callbacks",
  "callback_share",
];

export class Executors {
  constructor(app) {
    this.app = app;
  }

  async build() {
    const sections = [this.threads(), this.programs(), this.blame(), this.waits()];
    return (await Promise.all(sections)).flat().filter(Boolean);
  }

  // What used the CPUs of each host over time, where that was sampled, or the kernel traced.
  async programs() {
    const shares = await this.app.inWindow("program_share");
    const hosts = [...new Set(shares.host)];
    return hosts.map((host) => {
      const rows = shares.host.map((_, row) => row).filter((row) => shares.host[row] === host);
      const times = [...new Set(rows.map((row) => shares.start_at[row]))].sort((a, b) => a - b);
      const lengths = new Map(rows.map((row) => [shares.start_at[row], shares.length[row]]));
      const programs = [...new Set(rows.map((row) => shares.program[row]))];
      // What used no CPU has no row.
      const used = new Map(
        rows.map((row) => [
          `${shares.start_at[row]} ${shares.program[row]}`,
          shares.busy[row] / shares.length[row],
        ]),
      );
      const middles = times.map((at) => at + lengths.get(at) / 2);
      const series = programs.map((program, place) => ({
        label: program ?? "all others",
        color: program === null ? "soft" : SERIES_COLORS[place % SERIES_COLORS.length],
        values: times.map((at) => used.get(`${at} ${program}`) ?? 0),
      }));
      return h(
        "section",
        {},
        h("h2", {}, `What used the CPUs${hosts.length > 1 ? ` of ${host}` : ""}`),
        h(
          "p",
          { className: "soft" },
          "CPUs that each program used, those without ROS included. Click to see that time in the timeline.",
        ),
        chart(middles, series, {
          title: `what used the CPUs of ${host}`,
          xName: "middle [ns since begin of run]",
          xFormat: duration,
          xLabel: "since the begin of the run",
          yFormat: (value) => String(Math.round(value * 100) / 100),
          yLabel: "CPUs",
          legend: true,
          marks: this.app.happened(),
          onClick: (at) => {
            location.hash = pageAddress("timeline", {
              from: Math.max(0, Math.round(times[at])),
              to: Math.round(times[at] + lengths.get(times[at])),
            });
          },
        }),
      );
    });
  }

  async threads() {
    const { app } = this;
    const [usage, shares] = await Promise.all([
      app.query("executor-usage"),
      app.inWindow("executor_share"),
    ]);
    this.marks = [];
    app.happened().then((marks) => {
      this.marks = marks;
      this.draw();
    });
    if (!usage.rows) return null;
    this.strips = { shares, places: [] };
    const { extent } = app;
    const ticks = [0, 0.25, 0.5, 0.75, 1].map((share) =>
      h("span", {}, duration(extent.start + share * (extent.end - extent.start)))
    );
    const list = h(
      "div",
      { className: "strips" },
      h(
        "div",
        { className: "strip-row strip-axis" },
        h("div", {}, "since the begin of the run"),
        h("div", { className: "axis" }, ticks),
      ),
    );
    for (let row = 0; row < usage.rows; row++) {
      const canvas = h("canvas", {
        className: "strip",
        role: "img",
        "aria-label": `what thread ${usage.tid[row]} did over time`,
      });
      this.strips.places.push({ canvas, thread: usage.thread_id[row] });
      const busy = usage.seen_ns[row] ? usage.callback_ns[row] / usage.seen_ns[row] : NaN;
      const running = usage.running_share?.[row] ?? NaN;
      list.append(
        h(
          "div",
          { className: "strip-row" },
          h(
            "div",
            {},
            h("b", {}, `${usage.nodes[row]} ${usage.tid[row]}`),
            h(
              "div",
              { className: "soft" },
              `${usage.host[row]} · ${String(usage.executor_kind[row]).replace("_", "-")} · ${
                percent(busy)
              } in callbacks${Number.isNaN(running) ? "" : `, ${percent(running)} on a CPU`}`,
            ),
          ),
          canvas,
        ),
      );
    }
    new ResizeObserver(() => this.draw()).observe(list);
    return h(
      "section",
      {},
      h("h2", {}, "What executor threads did"),
      h(
        "p",
        { className: "soft" },
        "Each column is a piece of the run, filled with the share of time that went to each: a full column is 100 %. Click to see it in the timeline.",
      ),
      h(
        "div",
        { className: "legend" },
        ACTIVITIES.map(([, shade, text]) =>
          h(
            "span",
            { className: "legend-item" },
            h("span", { className: `swatch color-${shade}` }),
            text,
          )
        ),
      ),
      list,
      downloads({
        name: "what executor threads did",
        canvases: () => this.strips.places.map(({ canvas }) => canvas),
        columns: () => [
          ["thread_id", shares.thread_id],
          ["start_at [ns since begin of run]", shares.start_at],
          ["length [ns]", shares.length],
          ["activity", shares.activity],
          ["busy [ns]", shares.busy],
        ],
      }),
      besides(
        "as a table",
        dataTable(usage, {
          label: "executor threads",
          columns: [...OF_THREADS, ...filled(usage, ["running_share", "waiting_share"])],
        }),
      ),
      notes(usage.meta.notes),
      command(usage.meta.command),
    );
  }

  async blame() {
    const table = await this.app.query("waits-pair");
    return this.table(
      table,
      "Who kept whom waiting",
      "Callbacks that were ready while another one ran on their executor, and how long that ran: shorter callbacks, other callback groups or more threads help here.",
      {
        label: "interference",
        sort: { name: "overlap_max_ns", down: true },
        columns: [
          "node",
          "callback",
          "meanwhile_node",
          "meanwhile_callback",
          ...filled(table, ["meanwhile_thread"]),
          "waits",
          "instances",
          "overlap_min_ns",
          "overlap_max_ns",
          "worst_ns",
          "share",
        ],
      },
    );
  }

  async waits() {
    const table = await this.app.query("waits");
    return this.table(
      table,
      "How long callbacks waited",
      "From the moment at which a callback could have run to its start. At least and at most: when a message came to the host is not recorded, only when it was taken.",
      {
        label: "waits",
        sort: { name: "busy_worst_ns", down: true },
        columns: [
          "node",
          "callback",
          "count",
          "delayed_min",
          "delayed_max",
          "wait_median_ns",
          "wait_max_ns",
          "busy_worst_ns",
          "busy_total_min_ns",
          "busy_total_max_ns",
          "meanwhile",
          ...filled(table, ["run_queue_worst_ns", "preempted_worst_ns", "cpu_taken_by"]),
          "unknown",
          "loss_affected",
        ],
      },
    );
  }

  table(table, title, help, options) {
    return table.rows > 0 && h(
      "section",
      {},
      h("h2", {}, title),
      h("p", { className: "soft" }, help),
      dataTable(table, { shown: 20, ...options }),
      notes(table.meta.notes),
      command(table.meta.command),
    );
  }

  draw() {
    if (!this.strips) return;
    const { shares, places } = this.strips;
    const byThread = new Map();
    for (let row = 0; row < shares.rows; row++) {
      const thread = shares.thread_id[row];
      if (!byThread.has(thread)) byThread.set(thread, []);
      byThread.get(thread).push(row);
    }
    const { start, end } = this.app.extent;
    const whole = end - start || 1;
    for (const { canvas, thread } of places) {
      const ratio = devicePixelRatio || 1;
      const box = canvas.getBoundingClientRect();
      if (!box.width) continue;
      canvas.width = box.width * ratio;
      canvas.height = box.height * ratio;
      const context = canvas.getContext("2d");
      context.scale(ratio, ratio);
      context.fillStyle = color("panel");
      context.fillRect(0, 0, box.width, box.height);
      const filled = new Map();
      const rows = byThread.get(thread) ?? [];
      for (const [activity, shade] of ACTIVITIES) {
        context.fillStyle = color(shade);
        for (const row of rows) {
          if (shares.activity[row] !== activity) continue;
          const x = ((shares.start_at[row] - start) / whole) * box.width;
          const width = Math.max((shares.length[row] / whole) * box.width, 1) + 0.3;
          const below = filled.get(shares.start_at[row]) ?? 0;
          const high = (shares.busy[row] / shares.length[row]) * box.height;
          context.fillRect(x, box.height - below - high, width, high);
          filled.set(shares.start_at[row], below + high);
        }
      }
      for (const mark of this.marks) {
        context.fillStyle = color(mark.color);
        context.fillRect(((mark.at - start) / whole) * box.width - 1, 0, 2, 6);
      }
      canvas.onclick = (event) => {
        const at = start + (event.offsetX / box.width) * whole;
        location.hash = pageAddress("timeline", {
          from: Math.max(0, Math.round(at - whole / 100)),
          to: Math.round(at + whole / 100),
        });
      };
    }
  }
}
