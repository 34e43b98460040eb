// Timers: whether they keep their period, how late they are called, and why.

import { clear, h } from "./dom.js";
import { commands, notes, waiting } from "./notice.js";
import { callbackPanel, Chooser } from "./panel.js";

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

export class TimersPage {
  constructor(app, root) {
    this.app = app;
    this.root = root;
    this.ready = this.build();
  }

  async build() {
    const { app } = this;
    clear(this.root, waiting("comparing timers with their periods …"));
    const table = await app.query("timers");
    const columns = COLUMNS_OF_TIMERS.filter((name) =>
      !SELDOM_OF_TIMERS.includes(name) || table[name].some((value) => value)
    );
    this.chooser = new Chooser(app, {
      key: "callback",
      label: "timers",
      columns,
      sort: { name: "lateness_max_ns", down: true },
      nothing: "No timer is known.",
      identity: (rows, row) => String(rows.callback_id[row]),
      panel: (rows, row) =>
        callbackPanel(app, rows.callback_id[row], `${rows.node[row] ?? ""} ${rows.callback[row]}`),
    });
    this.chooser.show(table);
    clear(
      this.root,
      h(
        "section",
        {},
        h("h2", {}, "Timers"),
        h(
          "p",
          { className: "soft" },
          "Jitter: how far the time from one call to the next is from the period. Lateness: from the moment at which the timer was due to its call. A click on a row shows the calls over time, and leads to the longest.",
        ),
        this.chooser.list,
        notes(table.meta.notes),
        commands([table]),
      ),
      this.chooser.detail,
    );
  }

  recolor() {
    this.chooser?.recolor();
  }
  leave() {}
}
