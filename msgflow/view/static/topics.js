// Topics: rate, jitter, drops and latency of each; of the chosen one who publishes and receives it.

import { clear, h } from "./dom.js";
import { shellQuoted } from "./labels.js";
import { dataTable } from "./table.js";
import { commands, failed, notes, sqlText, waiting } from "./notice.js";
import { redrawCharts } from "./chart.js";
import { losses, OF_DELIVERIES } from "./losses.js";
import {
  changesBeside,
  Chooser,
  onTimeline,
  overTime,
  ratesOverTime,
  searchField,
  slowestOnes,
} from "./panel.js";
import { Sections } from "./sections.js";
import { courseColumn, OF_TOPIC } from "./course.js";

const COLUMNS_OF_TOPICS = [
  "topic_name",
  "publication_count",
  "rate_hz",
  "period_deviation_ns",
  "latency_median_ns",
  "latency_p95_ns",
  "latency_max_ns",
  "delivered",
  "dropped",
  "lost",
  "reasons",
  "unknown",
  "not_connected",
  "cut_by_recording",
  "publisher_count",
  "subscription_count",
];
// The tables of a topic, and what each says.
const PARTS_OF_TOPIC = [
  ["topics-rate", "Publishers", [
    "publisher",
    "count",
    "rate_hz",
    "period_median_ns",
    "period_deviation_ns",
    "period_p95_ns",
    "period_max_ns",
  ]],
  ["topics-delivery", "What became of the messages", OF_DELIVERIES],
  ["topics-latency", "Latency from publication to take", [
    "subscriber",
    "takes",
    "median_ns",
    "p95_ns",
    "p99_ns",
    "max_ns",
    "busy_mean_min_ns",
    "busy_mean_max_ns",
  ]],
];

export class TopicsPage {
  constructor(app, root) {
    this.app = app;
    this.root = root;
    this.ready = this.build();
  }

  async build() {
    const { app } = this;
    const table = await app.query("topics-summary");
    const chooser = new Chooser(app, {
      key: "topic",
      label: "topics",
      columns: COLUMNS_OF_TOPICS,
      sort: { name: "publication_count", down: true },
      nothing: "No topic is known.",
      texts: (rows, row) => [rows.topic_name[row]],
      identity: (rows, row) => rows.topic_name[row] ?? "",
      panel: (rows, row) => this.panel(rows.topic_name[row]),
    }).show(table);
    const sections = new Sections({
      Topics: () =>
        chooser.section(
          "Topics",
          "Messages are counted at each subscription. A click on a row shows the topic over time, who publishes and who receives it, and leads to its slowest message.",
          notes(table.meta.notes),
          commands([table]),
        ),
      Losses: () => losses(app),
    });
    const search = searchField(app, "topic", () => [chooser]);
    clear(this.root, h("div", { className: "tools" }, search, sections.links), sections.places);
    this.complete = sections.complete;
    // How long its messages waited, else how far they were apart.
    courseColumn(app, table, (row) => [OF_TOPIC, table.topic_name[row]], () => {
      const [topic, ...others] = COLUMNS_OF_TOPICS;
      chooser.options.columns = [topic, "course", ...others];
      chooser.show(table);
    });
  }

  async panel(topic) {
    const { app } = this;
    const [points, slowest] = await Promise.all(
      ["topic_point", "topic_slowest"].map((name) => app.inWindow(name, { topic })),
    );
    const target = (rows) => (row) => onTimeline("take", rows.take_id[row]);
    const { place, marks } = changesBeside(app, (course) => course.of(OF_TOPIC, topic));
    const parts = PARTS_OF_TOPIC.map(([name, title, columns]) => {
      const body = h("div", {}, waiting());
      app.query(name).then((rows) => clear(body, this.part(rows, title, columns, topic)))
        .catch((error) => clear(body, failed(error)));
      return h("section", {}, h("h3", {}, title), body);
    });
    return [
      h("h2", { className: "path-title" }, topic ?? "topic not known"),
      points.rows
        ? h(
          "div",
          { className: "charts" },
          ratesOverTime(
            points,
            "messages over time",
            [{
              label: "published",
              color: "publication",
              values: Array.from(points.published),
            }, { label: "taken", color: "take", values: Array.from(points.taken), dash: [4, 3] }],
            marks,
          ),
          slowest.rows > 0 &&
            overTime(points, {
              title: "latency over time",
              values: "latency",
              median: "median",
              target: (row) => (points.take_id[row] ? target(points)(row) : location.hash),
              marks,
            }),
          slowestOnes(slowest, {
            title: "Slowest messages",
            values: "latency",
            target: target(slowest),
            columns: ["taken_at", "latency", "subscriber", "take_id"],
          }),
        )
        : h("p", {}, "No message in the window of time."),
      place,
      parts,
    ];
  }

  part(rows, title, columns, topic) {
    // An option takes a name for a pattern: others are compared as text.
    const only = /^[\w/]+$/.test(topic ?? "")
      ? `--topic ${topic}`
      : `--where ${
        shellQuoted(topic === null ? "topic_name IS NULL" : `topic_name = ${sqlText(topic)}`)
      }`;
    return [
      dataTable(rows, {
        label: title,
        columns,
        nothing: "none",
        only: (row) => (rows.topic_name[row] ?? null) === (topic ?? null),
      }),
      notes(rows.meta.notes),
      commands([{ meta: { command: `${rows.meta.command} ${only}` } }]),
    ];
  }

  recolor() {
    redrawCharts();
  }
  leave() {}
}
