// Data of a report: compressed in the file itself; it answers what a database answers otherwise.

import { decode } from "./table_decoding.js";

export async function embedded() {
  const element = document.getElementById("msgflow-data");
  if (!element) return null;
  const tables = await unpack(element.textContent);
  element.remove();
  return new EmbeddedSource(tables);
}

async function unpack(text) {
  const packed = bytesOf(text.trim());
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const view = new DataView(bytes.buffer);
  const headLength = view.getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + headLength)));
  let at = 4 + headLength;
  const tables = new Map();
  for (const { key, length } of head.parts) {
    tables.set(key, bytes.subarray(at, at + length));
    at += length;
  }
  return { head, tables };
}

function bytesOf(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let at = 0; at < binary.length; at++) bytes[at] = binary.charCodeAt(at);
  return bytes;
}

const KEY_KINDS = 8;

export class EmbeddedSource {
  constructor({ head, tables }) {
    this.isServed = false;
    this.head = head;
    this.tables = tables;
    this.notes = head.notes;
    // Of one flow alone: the pages there are, and what is on the first one.
    this.pages = head.pages;
    this.address = head.address;
    // Pages that would show nothing, and the sections of the summary.
    this.absent = head.absent ?? [];
    this.summary = head.summary;
    this.decoded = new Map();
  }

  async fetch(name, params = {}) {
    const { run, ...own } = params;
    if (name === "segments") return this.segments(own);
    if (name === "links") return this.links(own);
    if (name === "flow") return this.flow(own);
    if (name === "neighbour") return this.neighbour(own);
    // It has those of the whole run alone.
    if (name === "counter") return this.kept(name, { rates: own.rates }, run);
    // Which path was chosen is in what the report holds already.
    if (name === "critical") return this.kept(name, { kind: own.kind, id: own.id }, run);
    return this.kept(name, own, run);
  }

  kept(name, own, run) {
    const known = Object.entries(own).filter(([, value]) => value !== undefined && value !== null)
      .map(([key, value]) => `${key}=${value}`).sort().join("&");
    const key = name === "run" ? "run" : `${name}?${known}`;
    const alone = `${key}@${run}`;
    const found = this.tables.has(alone) ? alone : key;
    if (!this.decoded.has(found)) {
      if (!this.tables.has(found)) {
        const error = new Error("this report does not hold that");
        error.hint = "msgflow ui has everything that is in the database";
        throw error;
      }
      this.decoded.set(found, decode(this.tables.get(found)));
    }
    return this.decoded.get(found);
  }

  // Single bars of the stretches that the report holds; bins of the whole run besides.
  stretches() {
    return this.head.stretches;
  }

  detail(place) {
    return this.kept("detail", { place });
  }

  segments({ start, end }) {
    const stretches = this.stretches();
    const place = stretches.findIndex((one) => start >= one.start - 1 && end <= one.end + 1);
    if (stretches.length === 1 && stretches[0].whole) {
      const table = this.detail(0);
      return withMeta(table, {
        start: stretches[0].start,
        end: stretches[0].end,
        count: table.rows,
        whole: true,
      });
    }
    if (place >= 0) {
      const table = this.detail(place);
      return withMeta(table, {
        start: stretches[place].start,
        end: stretches[place].end,
        count: table.rows,
      });
    }
    const inside = stretches.find((one) => end > one.start && start < one.end);
    const table = this.kept("level", {});
    return withMeta(table, {
      start: this.head.start,
      end: this.head.end,
      count: this.head.count,
      bin: this.head.bin,
      note: inside
        ? "Single bars are in this report only near its slowest flows."
        : "Here this report has no single bars; msgflow ui has.",
    });
  }

  links({ start, end }) {
    const stretches = this.stretches();
    const place = stretches.length === 1
      ? 0
      : stretches.findIndex((one) => start >= one.start - 1 && end <= one.end + 1);
    if (place < 0) return { rows: 0, meta: {}, columns: [] };
    return this.kept("links", { place });
  }

  // Bars of things by kind and identity; identities of one run lie close together.
  vertices() {
    if (this.byId) return this.byId;
    const tables = this.stretches().map((_, place) => this.detail(place));
    const byId = Array.from({ length: 5 }, () => ({ least: Infinity, most: -1, place: null }));
    for (const table of tables) {
      for (let row = 0; row < table.rows; row++) {
        const kind = table.kind[row];
        if (kind >= 5) continue;
        const known = byId[kind];
        known.least = Math.min(known.least, table.id[row]);
        known.most = Math.max(known.most, table.id[row]);
      }
    }
    for (const known of byId) {
      known.place = new Int32Array(Math.max(known.most - known.least + 1, 0));
      known.table = new Uint8Array(known.place.length);
    }
    tables.forEach((table, number) => {
      for (let row = 0; row < table.rows; row++) {
        const kind = table.kind[row];
        if (kind >= 5) continue;
        const known = byId[kind];
        known.place[table.id[row] - known.least] = row + 1;
        known.table[table.id[row] - known.least] = number;
      }
    });
    this.byId = byId;
    this.barTables = tables;
    return byId;
  }

  bar(kind, id) {
    const known = this.vertices()[kind];
    if (!known || id < known.least || id > known.most) return null;
    const row = known.place[id - known.least] - 1;
    return row < 0 ? null : { table: this.barTables[known.table[id - known.least]], row };
  }

  // Links by their ends, as lists of positions: sorted once when a flow is first asked for.
  edges() {
    if (this.byEnd) return this.byEnd;
    const table = this.kept("edge", {});
    const key = (kinds, ids) => {
      const keys = new Float64Array(table.rows);
      for (let row = 0; row < table.rows; row++) keys[row] = ids[row] * KEY_KINDS + kinds[row];
      const order = new Uint32Array(table.rows);
      for (let row = 0; row < table.rows; row++) order[row] = row;
      order.sort((a, b) => keys[a] - keys[b]);
      const sorted = new Float64Array(table.rows);
      for (let row = 0; row < table.rows; row++) sorted[row] = keys[order[row]];
      return { order, sorted };
    };
    this.byEnd = {
      table,
      from: key(table.from_kind, table.from_id),
      to: key(table.to_kind, table.to_id),
    };
    return this.byEnd;
  }

  flow({ kind, id }) {
    const names = ["callback_instance", "publication", "take", "request", "response"];
    const start = id * KEY_KINDS + names.indexOf(kind);
    const { table, from, to } = this.edges();
    const rows = [];
    const effects = reach(start, from, table, table.to_kind, table.to_id);
    const causes = reach(start, to, table, table.from_kind, table.from_id);
    const all = new Set([...effects, ...causes]);
    const held = new Set();
    let outside = 0;
    for (const vertex of all) {
      if (this.bar(vertex % KEY_KINDS, Math.floor(vertex / KEY_KINDS))) held.add(vertex);
      else outside++;
    }
    for (const vertex of held) {
      const { table: bars, row } = this.bar(vertex % KEY_KINDS, Math.floor(vertex / KEY_KINDS));
      const one = {
        kind: vertex % KEY_KINDS,
        id: Math.floor(vertex / KEY_KINDS),
        row_key: bars.row_key[row],
        start_at: bars.start_at[row],
        length: bars.length[row],
        flags: bars.flags[row],
        is_effect: effects.has(vertex),
        is_cause: causes.has(vertex),
      };
      let found = false;
      for (const place of ending(vertex, to)) {
        const cause = table.from_id[place] * KEY_KINDS + table.from_kind[place];
        if (!held.has(cause)) continue;
        rows.push({
          ...one,
          from_kind: table.from_kind[place],
          from_id: table.from_id[place],
          link_kind: table.link_kind[place],
        });
        found = true;
      }
      if (!found) rows.push({ ...one, from_kind: NaN, from_id: NaN, link_kind: null });
    }
    rows.sort((a, b) => a.start_at - b.start_at || a.kind - b.kind || a.id - b.id);
    const result = {
      rows: rows.length,
      meta: { outside },
      columns: [],
      vertex_count: [all.size - outside],
    };
    for (
      const name of [
        "kind",
        "id",
        "row_key",
        "start_at",
        "length",
        "flags",
        "is_effect",
        "is_cause",
        "from_kind",
        "from_id",
        "link_kind",
      ]
    ) {
      result[name] = rows.map((row) => row[name]);
    }
    return result;
  }

  neighbour({ row, kind, id, step }) {
    const found = this.bar(kind, id);
    const none = { rows: 0, meta: {}, columns: [] };
    if (!found) return none;
    const { table } = found;
    for (
      let place = found.row + step;
      place >= 0 && place < table.rows && table.row_key[place] === row;
      place += step
    ) {
      if (table.kind[place] !== kind) continue;
      return {
        rows: 1,
        meta: {},
        columns: [],
        kind: [kind],
        id: [table.id[place]],
        start_at: [table.start_at[place]],
        length: [table.length[place]],
      };
    }
    return none;
  }
}

function withMeta(table, meta) {
  return { ...table, meta: { ...table.meta, ...meta } };
}

function* ending(vertex, { order, sorted }) {
  let [low, high] = [0, sorted.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (sorted[middle] < vertex) low = middle + 1;
    else high = middle;
  }
  for (let at = low; at < sorted.length && sorted[at] === vertex; at++) yield order[at];
}

// All that is reached from a vertex along the links, itself included.
function reach(start, index, table, kinds, ids) {
  const seen = new Set([start]);
  const waiting = [start];
  while (waiting.length) {
    for (const place of ending(waiting.pop(), index)) {
      const next = ids[place] * KEY_KINDS + kinds[place];
      if (!seen.has(next)) {
        seen.add(next);
        waiting.push(next);
      }
    }
  }
  return seen;
}
