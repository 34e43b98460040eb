// Timers: whether they keep their period, how late they are called, and why.

import { commands, notes } from "./notice.js";
import { callbackPanel } from "./panel.js";

const COLUMNS_OF_TIMERS = [
  "node",
  "callback",
  "period_ns",
  "rate_hz",
  "count",
  "missed",
  "bunched",
  "jitter_median_ns",
  "jitter_p99_ns",
  "jitter_max_ns",
  "lateness_median_ns",
  "lateness_p99_ns",
  "lateness_max_ns",
  "busy_share",
  "meanwhile",
  "off_grid",
  "unknown",
  "loss_affected",
];
// Shown only where they say something of a timer.
const SELDOM_OF_TIMERS = ["bunched", "off_grid", "unknown", "loss_affected"];

export async function timers(app, choose) {
  const table = await app.query("timers");
  if (!table.rows) return null;
  const columns = COLUMNS_OF_TIMERS.filter((name) =>
    !SELDOM_OF_TIMERS.includes(name) || table[name].some((value) => value)
  );
  return choose(table, {
    key: "timer",
    label: "timers",
    columns,
    sort: { name: "lateness_max_ns", down: true },
    identity: (rows, row) => String(rows.callback_id[row]),
    texts: (rows, row) => [rows.node[row], rows.callback[row]],
    panel: (rows, row) =>
      callbackPanel(app, rows.callback_id[row], rows.node[row], rows.callback[row]),
  }).section(
    "Timers",
    "Jitter: how far the time from one call to the next is from the period. Lateness: from the moment at which the timer was due to its call. A click on a row shows the calls over time, and leads to the longest.",
    notes(table.meta.notes),
    commands([table]),
  );
}
