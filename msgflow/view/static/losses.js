// Losses: messages that were not taken, and takes without a publication, by reason and over time.

import { clear, h } from "./dom.js";
import { current, pageAddress, replace } from "./address.js";
import { count, duration, momentAxis } from "./labels.js";
import { besides, dataTable } from "./table.js";
import { chart, counted } from "./chart.js";
import { command, commands, notes } from "./notice.js";
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

// What became of the messages of a subscription, as topics-delivery says it.
export const OF_DELIVERIES = [
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
];

// The section; null where nothing was lost.
export async function losses(app) {
  const [table, points, delivery] = await Promise.all([
    app.inWindow("loss", { internal: app.internal ? 1 : null }),
    app.inWindow("loss_point"),
    app.query("topics-delivery"),
  ]);
  const isOwn = (rows, row) => !rows.is_internal[row] || app.internal;
  const own = Array.from({ length: table.rows }, (_, row) => row).filter((row) =>
    isOwn(table, row)
  );
  if (!own.length) return null;
  const topics = [...new Set(own.map((row) => table.topic[row]))].filter((one) => one !== null);
  const topic = h(
    "select",
    {
      "aria-label": "lost on topic",
      on: {
        change: () => {
          replace({ lost: topic.value });
          app.linksMoved();
          show();
        },
      },
    },
    h("option", { value: "" }, "all topics"),
    topics.sort().map((one) => h("option", { value: one, selected: one === current().lost }, one)),
  );
  const isShown = (rows, row) =>
    isOwn(rows, row) && (!topic.value || rows.topic[row] === topic.value);
  const body = h("div");
  const show = () => {
    const number = (status) =>
      own.reduce(
        (sum, row) =>
          sum + (isShown(table, row) && table.status[row] === status ? table.count[row] : 0),
        0,
      );
    const hidden = table.rows - own.length;
    clear(
      body,
      h(
        "p",
        {},
        `${count(number("dropped"), "message")} dropped, ${
          number("lost").toLocaleString("en-US")
        } lost on the way, ${number("unknown").toLocaleString("en-US")} with an unknown fate; ${
          count(number("orphan"), "take")
        } without a known publication.`,
      ),
      dataTable(table, {
        label: "losses",
        columns: ["topic", "subscriber", "status", "reason", "count", "first_at", "last_at"],
        sort: { name: "count", down: true },
        only: (row) => isShown(table, row),
        onPick: (row) => {
          location.hash = onTimeline(table.kind[row], table.id[row]);
        },
      }),
      hidden > 0 && notes([`${count(hidden, "row")} of topics of ROS itself not shown`]),
      command(table.meta.command),
      course(app, points, (row) => isShown(points, row)),
    );
  };
  show();
  return h(
    "section",
    {},
    h("h2", {}, "Losses"),
    h(
      "p",
      { className: "soft" },
      "Messages that a subscription did not take, and takes whose publication is not known, by reason. A click on a row leads to the first one on the timeline.",
    ),
    h("div", { className: "tools" }, topic),
    body,
    h("h3", {}, "What became of the messages, by subscription"),
    dataTable(delivery, {
      label: "delivery",
      columns: ["topic_name", ...OF_DELIVERIES],
      sort: { name: "dropped", down: true },
    }),
    notes(delivery.meta.notes),
    commands([delivery]),
  );
}

// How many messages had each fate, in each piece of time.
function course(app, points, isShown) {
  const rows = Array.from({ length: points.rows }, (_, row) => row).filter(isShown);
  if (!rows.length) return null;
  const width = points.length[rows[0]];
  const { start, end } = app.extent;
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
    h("h3", {}, "Over time"),
    h("p", { className: "soft" }, `How many in each ${duration(width)}.`),
    chart(times, series, {
      title: "losses over time",
      legend: true,
      xFormat: momentAxis,
      yFormat: counted,
      xName: "begin [ns since begin of run]",
      marks: app.happened(),
      onClick: (at) => {
        location.hash = pageAddress("timeline", { from: times[at], to: times[at] + width });
      },
    }),
    besides(
      "as a table",
      dataTable(points, {
        label: "losses over time",
        columns: ["start_at", "topic", "status", "reason", "count"],
        only: isShown,
      }),
    ),
  ];
}
