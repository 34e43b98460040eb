// Services and actions: how long calls and goals took, and which were not answered.

import { h } from "./dom.js";
import { dataTable } from "./table.js";
import { commands, notes } from "./notice.js";
import { onTimeline, overTime, ratesOverTime, slowestOnes } from "./panel.js";

const COLUMNS_OF_SERVICES = [
  "service_name",
  "client",
  "server",
  "requests",
  "answered",
  "not_taken",
  "not_answered",
  "not_received",
  "round_trip_median_ns",
  "round_trip_p95_ns",
  "round_trip_p99_ns",
  "round_trip_max_ns",
  "request_median_ns",
  "wait_median_ns",
  "callback_median_ns",
  "reply_median_ns",
  "response_median_ns",
];
const OF_ACTIONS = [
  "action_name",
  "client",
  "server",
  "goals",
  "accepted",
  "rejected",
  "not_answered",
  "finished",
  "cancelled",
  "result_median_ns",
  "result_p95_ns",
  "result_max_ns",
  "accept_median_ns",
  "first_feedback_median_ns",
  "execution_median_ns",
  "feedback",
  "doubtful",
];

export async function services(app, choose) {
  const table = await app.query("service-latency");
  return table.rows > 0 && choose(table, {
    key: "call",
    label: "services",
    columns: COLUMNS_OF_SERVICES,
    sort: { name: "round_trip_max_ns", down: true },
    texts: (rows, row) => [rows.service_name[row], rows.client[row], rows.server[row]],
    identity: (rows, row) => `${rows.service_id[row]}:${rows.client_id[row]}`,
    panel: (rows, row) => callPanel(app, rows, row),
  }).section(
    "Services",
    "From the request that the client sends to the response that it takes, on its own clock. A click on a row shows the calls over time, and leads to the longest.",
    notes(table.meta.notes),
    commands([table]),
  );
}

export async function actions(app) {
  const table = await app.query("action-latency");
  return table.rows > 0 && h(
    "section",
    {},
    h("h2", {}, "Actions"),
    dataTable(table, {
      label: "actions",
      columns: OF_ACTIONS,
      sort: { name: "result_max_ns", down: true },
    }),
    notes(table.meta.notes),
    commands([table]),
  );
}

async function callPanel(app, rows, row) {
  const asked = { client: Number.isNaN(rows.client_id[row]) ? null : rows.client_id[row] };
  const [points, slowest] = await Promise.all(
    ["service_point", "service_slowest"].map((name) => app.inWindow(name, asked)),
  );
  const target = (table) => (at) => onTimeline("request", table.request_id[at]);
  const head = h(
    "h2",
    { className: "path-title" },
    `${rows.service_name[row] ?? "service not known"}, called by ${
      rows.client[row] ?? "a client not known"
    }`,
  );
  if (!points.rows) return [head, h("p", {}, "No call began in the window of time.")];
  return [
    head,
    h(
      "div",
      { className: "charts" },
      slowest.rows > 0 &&
        overTime(points, {
          title: "round trip over time",
          values: "duration",
          median: "median",
          target: target(points),
          marks: app.happened(),
        }),
      ratesOverTime(points, "calls over time", [{
        label: "calls",
        color: "call",
        values: Array.from(points.count),
      }, {
        label: "answered",
        color: "service",
        values: Array.from(points.answered),
        dash: [4, 3],
      }], app.happened()),
      slowestOnes(slowest, {
        title: "Longest calls",
        values: "duration",
        target: target(slowest),
        columns: ["start_at", "duration", "request_id"],
      }),
    ),
  ];
}
