// Charts of the rows of any query: lines, bars, and how values are distributed.

import { clear, h } from "./dom.js";
import { chart, counted } from "./chart.js";
import { duration, momentAxis } from "./labels.js";

export const DRAWINGS = ["table", "line", "bars", "histogram"];
export const drawingOf = (asked) => (DRAWINGS.includes(asked) ? asked : DRAWINGS[0]);
const MOST_BINS = 60;
const MOST_BARS_OF_ROWS = 60;
const LONGEST_UNDER_BAR = 24;
// Room for a name that stands aslant, in pixels.
const NAME_WIDTH = 18;
const EVERY = { label: "every number" };
export const SERIES_COLORS = [
  "timer",
  "publication",
  "take",
  "service",
  "process",
  "blocked",
  "event",
];

export class Figures {
  // Rows: as the SQL page has them.
  constructor(rows) {
    this.rows = rows;
    this.chosen = {};
  }

  get numbers() {
    return this.rows.columns.filter(({ type }) => type === "integer" || type === "double");
  }

  drawn(drawing) {
    const body = h("div");
    const numbers = this.numbers.filter(({ label }) => !/(^|_)id$/.test(label));
    const across = drawing === "bars" ? this.rows.columns : this.numbers;
    if (!this.rows.rows || !across.length || !numbers.length) {
      return h("p", {}, "There are no numbers to draw.");
    }
    const first = across.find(({ run }) => run) ?? across[0];
    const x = this.choice("x", across, first, () => show());
    // Bars of several columns would hide each other.
    const upwards = drawing === "line" ? [EVERY, ...numbers] : numbers;
    const y = drawing === "histogram" ? null : this.choice(
      "y",
      upwards,
      drawing === "line" ? EVERY : numbers.find((column) => column !== first) ?? first,
      () => show(),
    );
    const show = () => {
      const column = x.picked();
      const columns = y &&
        (y.picked() === EVERY && numbers.length > 1
          ? numbers.filter((one) => one !== column)
          : y.picked() === EVERY
          ? numbers
          : [y.picked()]);
      clear(
        body,
        drawing === "histogram"
          ? this.histogram(column)
          : drawing === "bars"
          ? this.bars(column, columns)
          : this.line(column, columns),
      );
    };
    show();
    return h(
      "div",
      {},
      h(
        "div",
        { className: "tools" },
        h("label", {}, drawing === "histogram" ? "of " : "over ", x.select),
        y && h("label", {}, "what ", y.select),
      ),
      body,
    );
  }

  // A select of columns; the choice is kept for the other charts of the same rows.
  choice(key, options, first, changed) {
    const kept = options.includes(this.chosen[key]) ? this.chosen[key] : first;
    const select = h("select", {
      "aria-label": key === "x" ? "across" : "upwards",
      on: {
        change: () => {
          this.chosen[key] = options[select.selectedIndex];
          changed();
        },
      },
    }, options.map((option) => h("option", { selected: option === kept }, option.label)));
    return { select, picked: () => options[select.selectedIndex] };
  }

  line(x, columns) {
    const order = Array.from({ length: this.rows.rows }, (_, row) => row).filter((row) =>
      !Number.isNaN(this.rows[x.name][row])
    )
      .sort((a, b) => this.rows[x.name][a] - this.rows[x.name][b]);
    return chart(order.map((row) => this.rows[x.name][row]), this.series(columns, order), {
      title: `${columns.map(({ label }) => label).join(", ")} over ${x.label}`,
      xFormat: format([x]),
      yFormat: format(columns),
      xName: x.label,
      xLabel: x.label,
      legend: true,
    });
  }

  bars(x, columns) {
    const order = Array.from(
      { length: Math.min(this.rows.rows, MOST_BARS_OF_ROWS) },
      (_, row) => row,
    );
    const name = (at) => {
      const text = x.shown(order[at]);
      return text.length > LONGEST_UNDER_BAR ? `…${text.slice(1 - LONGEST_UNDER_BAR)}` : text;
    };
    const middles = (plot) => {
      const step =
        Math.ceil((order.length * NAME_WIDTH) / plot.bbox.width * (devicePixelRatio || 1)) || 1;
      return order.filter((at) => at % step === 0).map((at) => at + 0.5);
    };
    return [
      this.rows.rows > MOST_BARS_OF_ROWS &&
      h("p", { className: "soft" }, `The first ${MOST_BARS_OF_ROWS} rows.`),
      chart(
        [...order.keys(), order.length],
        this.series(columns, order).map((one) => ({
          ...one,
          values: [...one.values, null],
          bars: true,
          fill: true,
        })),
        {
          title: `${columns.map(({ label }) => label).join(", ")} by ${x.label}`,
          height: 340,
          xFormat: (middle) => name(middle - 0.5),
          yFormat: format(columns),
          xName: "row",
          legend: true,
          xAxis: { size: 150, rotate: -60, splits: middles },
        },
      ),
    ];
  }

  histogram(x) {
    const values = Array.from(this.rows[x.name]).filter(Number.isFinite);
    if (!values.length) return h("p", {}, "There are no numbers to draw.");
    const [low, high] = values.reduce(
      ([least, most], value) => [Math.min(least, value), Math.max(most, value)],
      [Infinity, -Infinity],
    );
    const bins = Math.min(Math.max(Math.ceil(Math.sqrt(values.length)), 1), MOST_BINS);
    const width = (high - low) / bins || 1;
    const counts = new Array(bins).fill(0);
    for (const value of values) counts[Math.min(Math.floor((value - low) / width), bins - 1)]++;
    return chart([...counts.keys(), bins].map((bin) => low + bin * width), [{
      label: "rows",
      color: "timer",
      values: [...counts, null],
      bars: true,
      fill: true,
    }], {
      title: `how many rows by ${x.label}`,
      xFormat: format([x]),
      yFormat: counted,
      xName: `${x.label}, from`,
      xLabel: x.label,
    });
  }

  series(columns, order) {
    return columns.map((column, at) => ({
      label: column.label,
      color: SERIES_COLORS[at % SERIES_COLORS.length],
      values: order.map((row) => {
        const value = this.rows[column.name][row];
        return Number.isFinite(value) ? value : null;
      }),
    }));
  }
}

// Moments and durations with units, where all columns are such; else plain numbers.
function format(columns) {
  if (columns.every(({ run }) => run)) return momentAxis;
  if (columns.every(({ label, run }) => label.endsWith("_ns") && !run)) return duration;
  return (value) => Number(value).toLocaleString("en-US", { maximumSignificantDigits: 6 });
}
