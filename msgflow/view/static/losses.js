// Losses: messages that were not taken, and takes without a publication, by reason and over time.

import { clear, h } from "./dom.js";
import { current, pageAddress, replace } from "./address.js";
import { count, duration, momentAxis } from "./labels.js";
import { besides, dataTable } from "./table.js";
import { chart, redrawCharts } from "./chart.js";
import { command, commands, notes } from "./notice.js";
import { fill, section } from "./overview.js";
import { onTimeline } from "./panel.js";

// What became of a message, in words and colours. The first two are losses, the others may be none.
const FATES_OF_MESSAGES = [
  ["dropped", "dropped: a queue was full", "second"],
  ["lost", "lost on the way", "error"],
  ["not_connected", "not connected", "subscription"],
  ["cut_by_recording", "cut by the end of the recording", "wait"],
  ["unknown", "unknown: the trace does not tell", "faint"],
  ["orphan", "taken, and its publication is not known", "service"],
];

export class LossesPage {
  constructor(app, root) {
    this.app = app;
    this.root = root;
    this.ready = this.build();
  }

  async build() {
    const { app } = this;
    const over = section("Over time");
    const delivery = section("What became of the messages, by subscription");
    const [losses, points] = await Promise.all([
      app.inWindow("loss", { internal: app.internal ? 1 : null }),
      app.inWindow("loss_point"),
    ]);
    this.losses = losses;
    this.points = points;
    const topics = [...new Set(losses.topic)].filter((topic) => topic !== null).sort();
    this.topic = h(
      "select",
      {
        "aria-label": "topic",
        on: {
          change: () => {
            replace({ topic: this.topic.value });
            app.linksMoved();
            this.show();
          },
        },
      },
      h("option", { value: "" }, "all topics"),
      topics.map((topic) =>
        h("option", { value: topic, selected: topic === current().topic }, topic)
      ),
    );
    this.list = h("div");
    this.picture = h("div");
    clear(over.body, this.picture);
    clear(
      this.root,
      h(
        "section",
        {},
        h("h2", {}, "Losses"),
        h(
          "p",
          { className: "soft" },
          "Messages that a subscription did not take, and takes whose publication is not known, by reason. A click on a row leads to the first one on the timeline.",
        ),
        h("div", { className: "tools" }, this.topic),
        this.list,
      ),
      over.root,
      delivery.root,
    );
    this.show();
    await fill(delivery, async () => {
      const table = await app.query("topics-delivery");
      return [
        dataTable(table, {
          label: "delivery",
          columns: [
            "topic_name",
            "subscriber",
            "published",
            "delivered",
            "dropped",
            "lost",
            "reasons",
            "not_connected",
            "cut_by_recording",
            "unknown",
            "delivered_percent",
            "lost_percent",
            "orphans",
            "orphan_reasons",
          ],
          sort: { name: "dropped", down: true },
          nothing: "No message was sent to a subscription.",
        }),
        notes(table.meta.notes),
        commands([table]),
      ];
    });
  }

  isShown(table, row) {
    const isHidden = table.is_internal[row] && !this.app.internal;
    return !isHidden && (!this.topic.value || table.topic[row] === this.topic.value);
  }

  show() {
    const { losses, points, app } = this;
    const number = (names) =>
      Array.from(losses.count).reduce(
        (sum, value, row) =>
          sum + (this.isShown(losses, row) && names.includes(losses.status[row]) ? value : 0),
        0,
      );
    const hidden = Array.from(losses.is_internal).filter((one) => one && !app.internal).length;
    clear(
      this.list,
      h(
        "p",
        {},
        `${count(number(["dropped"]), "message")} dropped, ${
          number(["lost"]).toLocaleString("en-US")
        } lost on the way, ${number(["unknown"]).toLocaleString("en-US")} with an unknown fate; ${
          count(number(["orphan"]), "take")
        } without a known publication.`,
      ),
      dataTable(losses, {
        label: "losses",
        columns: ["topic", "subscriber", "status", "reason", "count", "first_at", "last_at"],
        sort: { name: "count", down: true },
        nothing: "Nothing was lost.",
        only: (row) => this.isShown(losses, row),
        onPick: (row) => {
          location.hash = onTimeline(losses.kind[row], losses.id[row]);
        },
      }),
      hidden > 0 && notes([`${count(hidden, "row")} of topics of ROS itself not shown`]),
      command(losses.meta.command),
    );
    clear(this.picture, this.course(points));
  }

  // How many messages had each fate, in each piece of time.
  course(points) {
    const rows = Array.from({ length: points.rows }, (_, row) => row).filter((row) =>
      this.isShown(points, row)
    );
    if (!rows.length) return h("p", {}, "Nothing was lost.");
    const width = points.length[rows[0]];
    const { start, end } = this.app.extent;
    // Pieces count from the begin of what was asked for, which a report cut by --start moves.
    const first = start + (((points.start_at[rows[0]] - start) % width) + width) % width;
    const times = [];
    for (let at = first > start ? first - width : start; at < end; at += width) times.push(at);
    const place = (row) =>
      Math.min(Math.round((points.start_at[row] - times[0]) / width), times.length - 1);
    const series = FATES_OF_MESSAGES.map(([status, label, color]) => {
      const values = times.map(() => 0);
      for (const row of rows) {
        if (points.status[row] === status) values[place(row)] += points.count[row];
      }
      return { label, color, values, stepped: true, fill: true };
    }).filter(({ values }) => values.some(Boolean));
    return [
      h("p", { className: "soft" }, `How many in each ${duration(width)}.`),
      chart(times, series, {
        title: "losses over time",
        legend: true,
        xFormat: momentAxis,
        yFormat: (value) => value.toLocaleString("en-US"),
        xName: "begin [ns since begin of run]",
        onClick: (at) => {
          location.hash = pageAddress("timeline", { from: times[at], to: times[at] + width });
        },
      }),
      besides(
        "as a table",
        dataTable(points, {
          label: "losses over time",
          columns: ["start_at", "topic", "status", "reason", "count"],
          only: (row) => this.isShown(points, row),
        }),
      ),
    ];
  }

  recolor() {
    redrawCharts();
  }
  leave() {}
}
