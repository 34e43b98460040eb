// Counters on the timeline: rows below the publisher, subscription or process that they are of.

export const COUNTER_KINDS = new Set(["queue", "rate", "cpu"]);
const COUNTER_NAMES = { queue: "queue", rate: "rate", cpu: "CPU use" };
const COUNTER_UNITS = { queue: " messages", rate: " Hz", cpu: " CPUs" };
const OF_ROWS = [
  "row_key",
  "kind",
  "object_id",
  "host",
  "process",
  "process_id",
  "node",
  "label",
  "symbol",
  "is_internal",
  "most",
];

export const counterText = (kind, value) =>
  `${Number(value.toPrecision(3)).toLocaleString("en-US")}${COUNTER_UNITS[kind]}`;

export class Counters {
  constructor(app, rows) {
    this.app = app;
    this.rows = rows;
    // Of the whole run: queues and CPUs, and, once somebody wants to see them, rates.
    this.tables = new Map();
    this.programs = new Map();
  }

  async read(rates) {
    if (!this.tables.has(rates)) {
      this.tables.set(rates, await this.app.fetch("counter", rates ? { rates } : {}));
    }
  }

  // The row of a counter: half behind that of its object, and of programs without ROS before all.
  keyOf(table, row) {
    if (table.kind[row] !== "cpu") return table.row_key[row] + 0.5;
    if (!Number.isNaN(table.process_id[row])) return 8 * table.process_id[row] + 7.5;
    const name = `${table.host[row]} ${table.name[row]}`;
    if (!this.programs.has(name)) this.programs.set(name, -0.5 - this.programs.size);
    return this.programs.get(name);
  }

  // Rows of the timeline, with those of the counters among them.
  withRows() {
    const { rows } = this;
    const known = new Map();
    for (const table of this.tables.values()) {
      for (let row = 0; row < table.rows; row++) {
        const key = this.keyOf(table, row);
        const before = known.get(key);
        const most = Math.max(table.value[row], before?.most ?? 0);
        if (before) before.most = most;
        else {
          known.set(key, {
            row_key: key,
            kind: table.kind[row],
            host: table.host[row],
            name: Number.isNaN(table.process_id[row]) ? table.name[row] : null,
            most,
          });
        }
      }
    }
    const made = Object.fromEntries(OF_ROWS.map((name) => [name, []]));
    const push = (record) => OF_ROWS.forEach((name) => made[name].push(record[name] ?? null));
    const counter = (found, of) =>
      push({
        ...of,
        ...found,
        object_id: NaN,
        symbol: null,
        label: `${found.name ?? COUNTER_NAMES[found.kind]} ≤ ${
          counterText(found.kind, found.most)
        }`,
      });
    const record = (row) =>
      Object.fromEntries(OF_ROWS.map((name) => [name, rows[name]?.[row] ?? null]));
    for (let row = 0; row < rows.rows; row++) {
      const own = record(row);
      push(own);
      const beside = known.get(own.row_key + 0.5);
      if (beside && beside.kind !== "cpu") counter(beside, own);
      if (rows.process_id[row + 1] !== own.process_id) {
        const used = known.get(8 * own.process_id + 7.5);
        if (used?.kind === "cpu") counter(used, { ...own, node: null, is_internal: false });
      }
      if (rows.host[row + 1] === own.host) continue;
      for (const found of known.values()) {
        if (found.name !== null && found.host === own.host) {
          const process = { process: "other programs", process_id: -0.5 - row, node: null };
          counter(found, { ...process, is_internal: false });
        }
      }
    }
    return { ...made, rows: made.row_key.length, meta: rows.meta, columns: rows.columns };
  }

  // Values of a window by the key of their row; a file has those of the whole run.
  async within(start, end, signal) {
    const values = new Map();
    for (const [rates, whole] of this.tables) {
      const asked = { start, end, ...(rates ? { rates } : {}) };
      const table = this.app.source.isServed
        ? await this.app.fetch("counter", asked, signal)
        : whole;
      for (let row = 0; row < table.rows; row++) {
        const key = this.keyOf(table, row);
        if (!values.has(key)) {
          const length = table.length[row];
          values.set(key, { at: [], values: [], last: [], length, until: end });
        }
        const one = values.get(key);
        one.at.push(table.start_at[row]);
        one.values.push(table.value[row]);
        one.last.push(table.last[row]);
      }
    }
    return values;
  }
}
