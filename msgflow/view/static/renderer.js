// Drawing of the timeline on a canvas: bars, bins of bars, arrows, gaps, the picked flow.

import { color } from "./dom.js";
import { lowerBound } from "./timeline_rows.js";
import { Crosses } from "./missing.js";
import {
  ACTIVE,
  BLOCKED,
  duration,
  EVENT,
  INACTIVE,
  MISSING,
  PALE,
  PART_COLORS,
  partTitle,
  PREEMPTED,
  RUNNABLE,
  RUNNING,
  SLEEPING,
  STATE_COLORS,
  stateText,
  UNINTERRUPTIBLE,
} from "./labels.js";

export const AXIS = 30;
const BAR_TOP = 3;
const LEAST_WIDTH = 1;

export function palette() {
  const names = [
    "ink",
    "soft",
    "faint",
    "page",
    "panel",
    "line",
    "stripe",
    "timer",
    "subscription",
    "service",
    "publication",
    "take",
    "call",
    "wait",
    "process",
    "execute",
    "blocked",
    "event",
    "active",
    "stored",
    "running",
    "preempted",
    "runnable",
    "uninterruptible",
    "transport",
    "direct",
    "indirect",
    "critical",
    "warning",
    "gap",
    "pick",
    "focus",
    "error",
  ];
  return Object.fromEntries(names.map((name) => [name, color(name)]));
}

export class Renderer {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.view = { from: 0, to: 1 };
    this.scroll = 0;
    this.labelWidth = 240;
    this.lanes = [];
    this.height = 0;
    this.bars = null;
    this.links = null;
    this.gaps = [];
    this.marks = [];
    this.counters = new Map();
    this.flow = null;
    this.names = new Map();
    this.hover = null;
    this.measure = null;
    this.drawn = { bars: 0, columns: 0 };
  }

  resize() {
    const ratio = devicePixelRatio || 1;
    const box = this.canvas.getBoundingClientRect();
    this.width = Math.max(box.width, 50);
    this.tall = Math.max(box.height, 50);
    this.canvas.width = Math.round(this.width * ratio);
    this.canvas.height = Math.round(this.tall * ratio);
    this.context.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.labelWidth = Math.round(Math.min(280, Math.max(112, this.width * 0.24)));
    this.colors = palette();
  }

  get plotWidth() {
    return Math.max(this.width - this.labelWidth, 10);
  }
  x(at) {
    return this.labelWidth +
      ((at - this.view.from) / (this.view.to - this.view.from)) * this.plotWidth;
  }
  time(x) {
    return this.view.from +
      ((x - this.labelWidth) / this.plotWidth) * (this.view.to - this.view.from);
  }
  laneAt(y) {
    const inside = y - AXIS + this.scroll;
    if (y < AXIS || inside < 0 || inside >= this.height) return null;
    let [low, high] = [0, this.lanes.length - 1];
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.lanes[middle].y <= inside) low = middle;
      else high = middle - 1;
    }
    return this.lanes[low];
  }

  draw() {
    const { context: c, colors } = this;
    c.clearRect(0, 0, this.width, this.tall);
    c.fillStyle = colors.page;
    c.fillRect(0, 0, this.width, this.tall);
    this.drawn = { bars: 0, columns: 0 };
    this.places = new Map();
    const first = this.scroll;
    const last = this.scroll + this.tall - AXIS;
    c.save();
    c.beginPath();
    c.rect(0, AXIS, this.width, this.tall - AXIS);
    c.clip();
    const shown = this.lanes.filter((lane) => lane.y + lane.height > first && lane.y < last);
    for (const lane of this.lanes) this.places.set(lane.key, AXIS + lane.y - this.scroll);
    for (const lane of shown) this.stripe(lane);
    this.drawGrid();
    this.drawGaps(shown);
    this.drawMarks();
    c.save();
    c.beginPath();
    c.rect(this.labelWidth, AXIS, this.plotWidth, this.tall - AXIS);
    c.clip();
    for (const lane of shown) {
      if (lane.type !== "row") continue;
      if (lane.isCounter) {
        c.globalAlpha = 1;
        this.drawCounter(lane);
        continue;
      }
      c.globalAlpha =
        this.flow && !["thread", "event", "state", "schedule", "core"].includes(lane.kind)
          ? 0.22
          : 1;
      this.drawRow(lane);
    }
    if (this.links && !this.flow) this.drawLinks();
    c.globalAlpha = 1;
    if (this.names.size) this.drawWakings(shown);
    c.globalAlpha = 1;
    if (this.flow) this.drawFlow();
    for (const lane of shown) if (lane.type === "critical") this.drawPieces(lane);
    this.drawMeasure();
    c.restore();
    for (const lane of shown) this.drawLabel(lane);
    c.restore();
    this.drawAxis();
  }

  stripe(lane) {
    const { context: c, colors } = this;
    const y = AXIS + lane.y - this.scroll;
    if (lane.type === "host") c.fillStyle = colors.stripe;
    else if (lane.type === "row") {
      c.fillStyle = this.hover?.lane === lane ? colors.stripe : colors.page;
    } else c.fillStyle = colors.panel;
    c.fillRect(0, y, this.width, lane.height);
    c.fillStyle = colors.line;
    c.fillRect(0, y + lane.height - 0.5, this.width, 0.5);
  }

  drawLabel(lane) {
    const { context: c, colors } = this;
    const y = AXIS + lane.y - this.scroll;
    c.fillStyle = lane.type === "host"
      ? colors.stripe
      : lane.type === "row"
      ? colors.page
      : colors.panel;
    c.fillRect(0, y, this.labelWidth, lane.height - 0.5);
    const indent = { critical: 6, host: 6, process: 14, node: 22, row: 34 }[lane.type];
    c.font = `${lane.type === "row" ? "" : "600 "}12px system-ui, sans-serif`;
    c.textBaseline = "middle";
    c.textAlign = "left";
    let left = this.width < 600 ? indent * 0.6 : indent;
    if (lane.type === "critical") {
      c.fillStyle = colors.critical;
      c.fillRect(left, y + lane.height / 2 - 1, 9, 2);
      left += 13;
    } else if (lane.type !== "row") {
      c.fillStyle = colors.soft;
      c.fillText(lane.folded ? "▸" : "▾", left, y + lane.height / 2);
      left += 13;
    } else {
      c.fillStyle = this.laneColor(lane.kind);
      mark(c, lane.kind, left - 8, y + lane.height / 2);
      left += 2;
    }
    c.fillStyle = lane.type === "row" && (lane.isInternal || lane.isBeside)
      ? colors.soft
      : colors.ink;
    const room = this.labelWidth - left - 6;
    const text = fit(
      c,
      lane.label,
      room,
      lane.type !== "process" && !lane.isCounter && !["thread", "schedule"].includes(lane.kind),
    );
    c.fillText(text, left, y + lane.height / 2);
    if (lane.name) {
      const beside = c.measureText(text).width + 7;
      c.fillStyle = colors.soft;
      if (room - beside > 40) {
        c.fillText(fit(c, lane.name, room - beside, true), left + beside, y + lane.height / 2);
      }
    }
    c.fillStyle = colors.line;
    c.fillRect(this.labelWidth - 1, y, 1, lane.height);
  }

  laneColor(kind) {
    const { colors } = this;
    return {
      timer: colors.timer,
      subscription: colors.subscription,
      service: colors.service,
      client: colors.call,
      publisher: colors.publication,
      callback: colors.timer,
      thread: colors.execute,
      schedule: colors.running,
      core: colors.running,
      event: colors.event,
      state: colors.active,
      queue: colors.take,
      rate: colors.publication,
      cpu: colors.running,
      program: colors.running,
      middleware: colors.soft,
    }[kind] ?? colors.soft;
  }

  barColor(kind, laneKind) {
    const { colors } = this;
    switch (kind) {
      case 0:
        return laneKind === "timer"
          ? colors.timer
          : laneKind === "service"
          ? colors.service
          : laneKind === "subscription"
          ? colors.subscription
          : colors.timer;
      case 1:
        return colors.publication;
      case 2:
        return colors.take;
      case 3:
      case 4:
        return colors.call;
      case 5:
      case INACTIVE:
        return colors.wait;
      case 6:
        return colors.process;
      case BLOCKED:
        return colors.blocked;
      case EVENT:
        return colors.event;
      case ACTIVE:
        return colors.active;
      case MISSING:
        return colors.error;
      case RUNNING:
        return colors.running;
      case PREEMPTED:
        return colors.preempted;
      case RUNNABLE:
        return colors.runnable;
      case SLEEPING:
        return colors.wait;
      case UNINTERRUPTIBLE:
        return colors.uninterruptible;
      case UNINTERRUPTIBLE + 1:
        return colors.faint;
      default:
        return colors.execute;
    }
  }

  // The value of a counter over time, as high as its share of the most in the run.
  drawCounter(lane) {
    const counter = this.counters.get(lane.key);
    if (!counter) return;
    const { context: c } = this;
    const top = AXIS + lane.y - this.scroll + BAR_TOP;
    const full = lane.height - 2 * BAR_TOP;
    c.fillStyle = this.laneColor(lane.kind);
    const column = (from, to, value) => {
      // Whole pixels: pieces that touch have no seam.
      const [x0, x1] = [from, to].map((at) =>
        Math.round(Math.min(Math.max(this.x(at), this.labelWidth), this.width))
      );
      const high = Math.min(value / (lane.most || 1), 1) * full;
      if (x1 > x0 && high > 0) c.fillRect(x0, top + full - high, x1 - x0, high);
    };
    const { at, length, values, last } = counter;
    for (let place = 0; place < at.length; place++) {
      const end = at[place] + length;
      column(at[place], end, values[place]);
      column(end, at[place + 1] ?? counter.until, last[place]);
    }
    this.drawn.columns += at.length;
  }

  // What a counter says at a moment.
  counterAt(lane, time) {
    const { at, length, values, last } = this.counters.get(lane.key) ?? { at: [] };
    const place = lowerBound(at, 0, at.length, time + 1) - 1;
    if (place < 0) return null;
    return time < at[place] + length ? values[place] : last[place];
  }

  // Through all rows: what happened at a moment.
  drawMarks() {
    const { context: c, colors } = this;
    c.globalAlpha = 0.35;
    for (const mark of this.marks) {
      const x = this.x(mark.at);
      if (x < this.labelWidth || x > this.width) continue;
      c.fillStyle = colors[mark.color];
      c.fillRect(x, AXIS, 1, this.tall - AXIS);
    }
    c.globalAlpha = 1;
  }

  // Bars of a pixel or more one by one; narrower ones together in columns, as high as their share
  // of the time, so that what is several does not look like one.
  drawRow(lane) {
    const range = this.bars?.ranges.get(lane.key);
    if (!range) return;
    const { context: c, colors } = this;
    const { table, reach } = this.bars;
    const { start_at: starts, length: lengths, kind: kinds, count: counts, busy, flags, id } =
      table;
    const { from, to } = this.view;
    const scale = this.plotWidth / (to - from);
    const top = AXIS + lane.y - this.scroll + BAR_TOP;
    const full = lane.height - 2 * BAR_TOP;
    const end = lowerBound(starts, range[0], range[1], to);
    let at = lowerBound(reach, range[0], end, from);
    const shares = new Float64Array(ORDER.length + 8);
    const crosses = new Crosses(c, colors);
    let column = -1;
    const flush = () => {
      if (column < 0) return;
      const x = this.labelWidth + column;
      let y = top + full;
      for (const kind of ORDER) {
        if (!shares[kind]) continue;
        const high = Math.min(Math.max(shares[kind] * full, leastHeight(kind, full)), y - top);
        if (high > 0) {
          c.fillStyle = this.barColor(kind, lane.kind);
          c.fillRect(x, y - high, 1, high);
          y -= high;
        }
        shares[kind] = 0;
      }
      this.drawn.columns++;
      column = -1;
    };
    for (; at < end; at++) {
      const begin = starts[at];
      const length = lengths[at];
      if (begin + length < from) continue;
      const kind = kinds[at];
      const several = counts ? counts[at] > 1 || Number.isNaN(id[at]) : false;
      const x0 = (begin - from) * scale;
      const wide = length * scale;
      if (kind === MISSING) {
        crosses.draw(
          this.labelWidth + x0 + (several ? wide / 2 : 0),
          top + full / 2,
          flags ? flags[at] : 0,
        );
        this.drawn.bars++;
      } else if (several) {
        // A bin: as high as the share of its time that is busy.
        flush();
        const share = length > 0 ? Math.min(busy[at] / length, 1) : 1;
        const high = Math.min(Math.max(share * full, leastHeight(kind, full)), full);
        const width = Math.max(wide, 1);
        const offset = this.binOffset(kind, table, at, full);
        c.fillStyle = this.barColor(kind, lane.kind);
        c.fillRect(this.labelWidth + x0, top + full - offset - high, width, high);
        this.drawn.columns++;
      } else if (wide >= LEAST_WIDTH) {
        flush();
        const x = Math.max(x0, -2);
        const width = Math.min(x0 + wide, this.plotWidth + 2) - x;
        c.fillStyle = this.barColor(kind, lane.kind);
        const inset = kind >= RUNNING
          ? (1 - STATE_SHARE[kind - RUNNING]) * full
          : flags && flags[at] & 8
          ? 4
          : 0;
        c.fillRect(this.labelWidth + x, top + inset, width, full - inset);
        if (flags && flags[at] & 1 && width > 3) {
          hatch(c, this.labelWidth + x, top, width, full, this.colors.page);
        }
        if (kind === PREEMPTED && width > 3) {
          hatch(c, this.labelWidth + x, top + inset, width, full - inset, this.colors.page);
        }
        if (wide > 46 && kind < 5) {
          this.nameCallback(kind, lane, length, this.labelWidth + x, top, width, full);
        } else if (
          wide > 46 && (kind === PREEMPTED || (kind === RUNNING && lane.kind === "core"))
        ) {
          this.nameBar(
            this.names.get(id[at]) ?? "",
            this.labelWidth + x,
            top,
            width,
            full,
            kind === PREEMPTED ? colors.preempted : undefined,
          );
        }
        this.drawn.bars++;
      } else {
        const own = Math.max(Math.floor(x0), 0);
        if (own !== column) {
          flush();
          column = own;
        }
        shares[kind] += Math.max(wide, 1e-9);
        this.drawn.bars++;
      }
    }
    flush();
  }

  // States of an executor stand on each other in a bin, as they fill it together.
  binOffset(kind, table, at, full) {
    if (kind < 5) return 0;
    let offset = 0;
    for (
      let other = at - 1;
      other >= 0 && table.start_at[other] === table.start_at[at] &&
      table.row_key[other] === table.row_key[at];
      other--
    ) {
      if (table.kind[other] < 5 || table.length[other] !== table.length[at]) break;
      offset += Math.min(table.busy[other] / table.length[other], 1) * full;
    }
    return Math.min(offset, full - 2);
  }

  nameBar(text, x, y, width, height, plate) {
    const { context: c } = this;
    c.font = "11px system-ui, sans-serif";
    c.textAlign = "left";
    c.textBaseline = "middle";
    c.fillStyle = this.colors.page;
    const left = Math.max(x, this.labelWidth) + 4;
    const { width: needed } = c.measureText(text);
    if (left + needed >= x + width - 2) return false;
    // Text on a hatched bar stands on a plain one.
    if (plate) {
      c.fillStyle = plate;
      c.fillRect(left - 2, y, needed + 4, height);
      c.fillStyle = this.colors.page;
    }
    c.fillText(text, left, y + height / 2 + 0.5);
    return true;
  }

  // The function of a callback stands on its bar where there is room beside the duration.
  nameCallback(kind, lane, length, ...place) {
    const text = duration(length);
    if (kind === 0 && lane.name && this.nameBar(`${lane.name} ${text}`, ...place)) return;
    this.nameBar(text, ...place);
  }

  center(key) {
    const y = this.places.get(key);
    return y === undefined ? null : y + HEIGHT_HALF;
  }

  drawLinks() {
    const {
      link_kind: kinds,
      from_row: fromRows,
      to_row: toRows,
      from_at: froms,
      to_at: tos,
      rows,
    } = this.links;
    const { from, to } = this.view;
    const visible = [];
    for (let at = 0; at < rows; at++) {
      if (Math.min(froms[at], tos[at]) > to) break;
      if (Math.max(froms[at], tos[at]) < from) continue;
      visible.push(at);
    }
    this.linkCount = visible.length;
    if (visible.length > 1500) return;
    const alpha = visible.length > 400 ? 0.35 : 0.7;
    for (const at of visible) {
      const y0 = this.center(fromRows[at]);
      const y1 = this.center(toRows[at]);
      if (y0 === null || y1 === null) continue;
      this.context.globalAlpha = alpha;
      this.arrow(this.x(froms[at]), y0, this.x(tos[at]), y1, LINK_STYLE[kinds[at]], 1);
    }
    this.context.globalAlpha = 1;
  }

  // From the thread that woke another one, where both have a row, at the moment of waking.
  drawWakings(shown) {
    const { from, to } = this.view;
    const { table, ranges } = this.bars ?? {};
    if (!table) return;
    const found = [];
    for (const lane of shown) {
      if (lane.kind !== "schedule") continue;
      const [first, last] = ranges.get(lane.key) ?? [0, 0];
      for (let at = first; at < last && found.length <= MOST_WAKINGS; at++) {
        const end = table.start_at[at] + table.length[at];
        const waker = table.id[at];
        if (table.start_at[at] > to) break;
        if (table.kind[at] !== SLEEPING || end < from || end > to || !(waker > 0) || waker % 2) {
          continue;
        }
        const y = this.center(-2 * waker - 2);
        if (y !== null && y !== undefined) found.push([this.x(end), y, this.center(lane.key)]);
      }
    }
    if (found.length > MOST_WAKINGS) return;
    for (const [x, y0, y1] of found) this.arrow(x, y0, x, y1, { color: "soft", dash: [3, 2] }, 1);
  }

  arrow(x0, y0, x1, y1, style, width) {
    const { context: c, colors } = this;
    c.strokeStyle = colors[style.color];
    c.fillStyle = colors[style.color];
    c.lineWidth = width;
    c.setLineDash(style.dash ?? []);
    c.beginPath();
    c.moveTo(x0, y0);
    c.lineTo(x1, y1);
    c.stroke();
    c.setLineDash([]);
    const length = Math.hypot(x1 - x0, y1 - y0);
    if (length < 8) return;
    const [dx, dy] = [(x1 - x0) / length, (y1 - y0) / length];
    const size = 4 + width;
    c.beginPath();
    c.moveTo(x1, y1);
    c.lineTo(x1 - dx * size - dy * size * 0.5, y1 - dy * size + dx * size * 0.5);
    c.lineTo(x1 - dx * size + dy * size * 0.5, y1 - dy * size - dx * size * 0.5);
    c.fill();
  }

  drawFlow() {
    const { context: c, colors, flow } = this;
    const laneKinds = new Map(this.lanes.map((lane) => [lane.key, lane]));
    for (const edge of flow.edges) {
      const [a, b] = [flow.vertices[edge.from], flow.vertices[edge.to]];
      if (edge.kind === "callback" && a.row === b.row) continue;
      const y0 = this.center(a.row);
      const y1 = this.center(b.row);
      if (y0 === null || y1 === null) continue;
      const [at0, at1] = edgeTimes(edge, a, b);
      const style = EDGE_STYLE[edge.kind] ?? EDGE_STYLE.direct;
      const critical = edge.critical;
      this.arrow(
        this.x(at0),
        y0,
        this.x(at1),
        y1,
        critical ? { ...style, color: "critical" } : style,
        critical ? 2.2 : 1.3,
      );
    }
    for (const vertex of flow.vertices) {
      const lane = laneKinds.get(vertex.row);
      if (!lane) continue;
      const y = AXIS + lane.y - this.scroll + BAR_TOP;
      const x0 = Math.max(this.x(vertex.at), this.labelWidth - 4);
      const x1 = Math.min(this.x(vertex.at + vertex.length), this.width + 4);
      if (x1 < this.labelWidth || x0 > this.width) continue;
      const width = Math.max(x1 - x0, 2);
      const full = lane.height - 2 * BAR_TOP;
      c.fillStyle = this.barColor(vertex.kind, lane.kind);
      c.fillRect(x0, y, width, full);
      if (vertex.flags & 1) hatch(c, x0, y, width, full, colors.page);
      if (vertex.critical) {
        c.strokeStyle = colors.critical;
        c.lineWidth = 1.5;
        c.strokeRect(x0 - 0.5, y - 0.5, width + 1, full + 1);
      }
      if (vertex.picked) {
        c.strokeStyle = colors.pick;
        c.lineWidth = 2;
        c.strokeRect(x0 - 2.5, y - 2.5, width + 5, full + 5);
      }
      if (width > 46) {
        this.nameCallback(vertex.kind, lane, vertex.length, x0, y, width, full);
      }
    }
  }

  // One piece of the critical path after the other, with a line below that makes them one.
  drawPieces(lane) {
    const { context: c, colors } = this;
    const { rows, from_ns: froms, duration_ns: lengths, activity, state, who, wakers } =
      this.flow.pieces;
    const y = AXIS + lane.y - this.scroll + 4;
    const high = lane.height - 10;
    for (let row = 0; row < rows; row++) {
      const [x0, x1] = [this.x(froms[row]), this.x(froms[row] + lengths[row])];
      if (x1 < this.labelWidth || x0 > this.width || lengths[row] <= 0) continue;
      const left = Math.max(x0, this.labelWidth - 2);
      const width = Math.max(Math.min(x1, this.width + 2) - left, 0.5);
      // What ran has the colour of what it did, what did not run that of why.
      const isStill = state?.[row] && state[row] !== "running";
      const name = isStill ? STATE_COLORS[state[row]] : PART_COLORS[activity[row]];
      const shade = colors[name] ?? colors.faint;
      c.fillStyle = shade;
      c.fillRect(left, y, width, high);
      if (width > 3) {
        c.fillStyle = colors.page;
        c.fillRect(left + width - 0.75, y, 0.75, high);
      }
      c.fillStyle = colors.critical;
      c.fillRect(left, y + high + 1, width, 2);
      if (width < 40) continue;
      c.font = "11px system-ui, sans-serif";
      c.textAlign = "left";
      c.textBaseline = "middle";
      c.fillStyle = PALE.has(name) ? colors.ink : colors.page;
      const took = duration(lengths[row]);
      for (
        const said of [
          ...(isStill
            ? [
              `${stateText(state[row], who[row], wakers?.[row])} ${took}`,
              stateText(state[row], who[row], wakers?.[row]),
            ]
            : []),
          `${partTitle(activity[row])} ${took}`,
          `${activity[row].replaceAll("_", " ")} ${took}`,
          took,
        ]
      ) {
        if (c.measureText(said).width < width - 8) {
          c.fillText(said, left + 4, y + high / 2 + 0.5);
          break;
        }
      }
    }
  }

  pieceAt(x) {
    const { rows, from_ns: froms, duration_ns: lengths } = this.flow.pieces;
    const at = this.time(x);
    for (let row = 0; row < rows; row++) {
      if (froms[row] <= at && at < froms[row] + lengths[row]) return row;
    }
    return undefined;
  }

  drawGaps(shown) {
    const { context: c, colors } = this;
    if (!this.gaps.length) return;
    const hosts = new Map();
    let host = null;
    for (const lane of this.lanes) {
      if (lane.type === "host") {
        host = { top: lane.y, bottom: lane.y + lane.height };
        const known = hosts.get(lane.label);
        if (known) known.push(host);
        else hosts.set(lane.label, [host]);
      } else if (host) host.bottom = lane.y + lane.height;
    }
    for (const gap of this.gaps) {
      if (gap.at > this.view.to || gap.at + gap.length < this.view.from) continue;
      const x0 = Math.max(this.x(gap.at), this.labelWidth);
      const x1 = Math.min(this.x(gap.at + gap.length), this.width);
      for (const place of hosts.get(gap.host) ?? []) {
        const top = Math.max(AXIS + place.top - this.scroll, AXIS);
        const bottom = Math.min(AXIS + place.bottom - this.scroll, this.tall);
        if (bottom <= top) continue;
        c.fillStyle = colors.gap;
        c.fillRect(x0, top, Math.max(x1 - x0, 1), bottom - top);
        if (x1 - x0 > 60) {
          c.fillStyle = colors.soft;
          c.font = "11px system-ui, sans-serif";
          c.textAlign = "center";
          c.fillText(`not recorded: ${gap.kind}`, (x0 + x1) / 2, top + 12);
        }
      }
    }
  }

  ticks() {
    const span = this.view.to - this.view.from;
    const wanted = span / Math.max(this.plotWidth / 120, 2);
    const power = 10 ** Math.floor(Math.log10(Math.max(wanted, 1)));
    const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= wanted) ??
      power * 10;
    const ticks = [];
    for (let at = Math.ceil(this.view.from / step) * step; at <= this.view.to; at += step) {
      ticks.push(at);
    }
    return { ticks, step };
  }

  drawGrid() {
    const { context: c, colors } = this;
    c.fillStyle = colors.line;
    for (const at of this.ticks().ticks) c.fillRect(Math.round(this.x(at)), AXIS, 0.5, this.tall);
  }

  drawAxis() {
    const { context: c, colors } = this;
    c.fillStyle = colors.panel;
    c.fillRect(0, 0, this.width, AXIS);
    c.fillStyle = colors.line;
    c.fillRect(0, AXIS - 1, this.width, 1);
    const { ticks, step } = this.ticks();
    c.font = "11px system-ui, sans-serif";
    c.textBaseline = "middle";
    c.fillStyle = colors.ink;
    const digits = Math.max(0, Math.min(9, Math.ceil(-Math.log10(step / 1e9))));
    for (const at of ticks) {
      const x = this.x(at);
      c.textAlign = x > this.width - 40 ? "right" : "center";
      if (x < this.labelWidth + 20) continue;
      c.fillText(`${(at / 1e9).toFixed(digits)} s`, x, AXIS / 2);
      c.fillRect(Math.round(x), AXIS - 5, 1, 4);
    }
    for (const mark of this.marks) {
      const x = this.x(mark.at);
      if (x < this.labelWidth || x > this.width) continue;
      c.fillStyle = colors[mark.color];
      c.beginPath();
      c.moveTo(x - 4, AXIS - 8);
      c.lineTo(x + 4, AXIS - 8);
      c.lineTo(x, AXIS - 1);
      c.fill();
    }
    c.fillStyle = colors.panel;
    c.fillRect(0, 0, this.labelWidth, AXIS - 1);
    c.fillStyle = colors.soft;
    c.textAlign = "left";
    c.fillText(
      fit(c, `${duration(this.view.to - this.view.from)} shown`, this.labelWidth - 12, true),
      8,
      AXIS / 2,
    );
  }

  drawMeasure() {
    if (!this.measure) return;
    const { context: c, colors } = this;
    const [x0, x1] = [this.x(this.measure.from), this.x(this.measure.to)];
    const { top, bottom } = this.measure;
    // Rows are part of it where it was drawn over several of them.
    const isArea = Math.abs(bottom - top) >= 8;
    const y = isArea ? AXIS + Math.min(top, bottom) - this.scroll : AXIS;
    const high = isArea ? Math.abs(bottom - top) : this.tall;
    c.fillStyle = colors.focus;
    c.globalAlpha = 0.12;
    c.fillRect(Math.min(x0, x1), y, Math.abs(x1 - x0), high);
    c.globalAlpha = 1;
    c.fillRect(x0, y, 1, high);
    c.fillRect(x1, y, 1, high);
    const text = duration(Math.abs(this.measure.to - this.measure.from));
    c.font = "600 13px system-ui, sans-serif";
    const width = c.measureText(text).width + 12;
    const left = Math.min(
      Math.max((x0 + x1) / 2 - width / 2, this.labelWidth + 4),
      this.width - width - 4,
    );
    c.fillRect(left, AXIS + 6, width, 20);
    c.fillStyle = colors.page;
    c.textAlign = "left";
    c.textBaseline = "middle";
    c.fillText(text, left + 6, AXIS + 16);
  }

  // What lies under a point: a bar, or how many there are where they are narrower than a pixel.
  pick(x, y) {
    const lane = this.laneAt(y);
    if (!lane) return null;
    if (lane.type === "critical" && x >= this.labelWidth) return { lane, piece: this.pieceAt(x) };
    if (x < this.labelWidth || lane.type !== "row") return { lane };
    const at = this.time(x);
    if (lane.isCounter) return { lane, value: this.counterAt(lane, at) };
    const scale = this.plotWidth / (this.view.to - this.view.from);
    if (this.flow) {
      const near = this.flow.vertices
        .filter((vertex) => vertex.row === lane.key)
        .map((vertex) => ({ vertex, far: distance(at, vertex.at, vertex.length) * scale }))
        .filter(({ far }) => far < 4)
        .sort((a, b) => a.far - b.far || a.vertex.length - b.vertex.length);
      if (near.length) {
        const { vertex } = near[0];
        return {
          lane,
          kind: vertex.kind,
          id: vertex.id,
          at: vertex.at,
          length: vertex.length,
          flags: vertex.flags,
          count: 1,
        };
      }
    }
    const range = this.bars?.ranges.get(lane.key);
    if (!range) return { lane };
    const { table, reach } = this.bars;
    const slack = 4 / scale;
    const end = lowerBound(table.start_at, range[0], range[1], at + slack);
    let best = null;
    let together = 0;
    let busy = 0;
    for (let place = lowerBound(reach, range[0], end, at - slack); place < end; place++) {
      const far = distance(at, table.start_at[place], table.length[place]) * scale;
      if (far > 4) continue;
      const several = table.count && (table.count[place] > 1 || Number.isNaN(table.id[place]));
      if (table.length[place] * scale < LEAST_WIDTH && !several && far < 1) {
        together++;
        busy += table.length[place];
      }
      const score = far * 1e6 + Math.min(table.length[place] * scale, 1e5) + (several ? 1e3 : 0);
      if (!best || score < best.score) best = { place, score, several };
    }
    if (!best) return { lane };
    const { place } = best;
    return {
      lane,
      kind: table.kind[place],
      id: table.id[place],
      at: table.start_at[place],
      length: table.length[place],
      flags: table.flags?.[place] ?? 0,
      count: table.count ? table.count[place] : 1,
      busy: table.busy?.[place] ?? table.length[place],
      isBin: Boolean(best.several),
      together,
    };
  }
}

// Waiting may be nothing; an event has no length, and no other bar beside it.
const leastHeight = (
  kind,
  full,
) => (kind === 5 || kind === SLEEPING ? 0 : kind === EVENT ? full : 4);
const HEIGHT_HALF = 10;
// Drawn from below: what an executor does for callbacks first.
// Messages that were not taken are crosses, not columns.
const ORDER = [
  7,
  BLOCKED,
  6,
  0,
  1,
  2,
  3,
  4,
  5,
  EVENT,
  ACTIVE,
  INACTIVE,
  RUNNING,
  PREEMPTED,
  RUNNABLE,
  UNINTERRUPTIBLE,
  SLEEPING,
  18,
];
// States differ by height, not by colour alone.
const STATE_SHARE = [1, 1, 0.6, 0.2, 0.4, 0.4];
const MOST_WAKINGS = 400;
const LINK_STYLE = [
  { color: "transport" },
  { color: "direct" },
  { color: "indirect", dash: [6, 3] },
  { color: "indirect", dash: [2, 3] },
  { color: "direct", dash: [4, 2] },
  { color: "direct", dash: [4, 2] },
  { color: "indirect", dash: [2, 3] },
  { color: "indirect", dash: [6, 3] },
];
const EDGE_STYLE = {
  transport: { color: "transport" },
  callback: { color: "transport" },
  direct: { color: "direct" },
  periodic_async: { color: "indirect", dash: [6, 3] },
  partial_sync: { color: "indirect", dash: [2, 3] },
  approximate_sync: { color: "indirect", dash: [2, 3] },
  queue: { color: "indirect", dash: [6, 3] },
  take_adjacent: { color: "direct", dash: [4, 2] },
  polled: { color: "direct", dash: [4, 2] },
  service: { color: "direct", dash: [4, 2] },
};

export function edgeTimes(edge, a, b) {
  if (edge.kind === "direct") return [b.at, b.at];
  if (edge.kind === "callback") return [a.kind === 3 ? a.at + a.length : a.at, b.at];
  return [a.at + a.length, b.at];
}

function distance(at, begin, length) {
  if (at < begin) return begin - at;
  return Math.max(at - begin - length, 0);
}

function fit(c, text, room, keepEnd) {
  if (c.measureText(text).width <= room) return text;
  let [low, high] = [0, text.length];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    const part = keepEnd ? `…${text.slice(text.length - middle)}` : `${text.slice(0, middle)}…`;
    if (c.measureText(part).width <= room) low = middle;
    else high = middle - 1;
  }
  return keepEnd ? `…${text.slice(text.length - low)}` : `${text.slice(0, low)}…`;
}

// Kinds of rows differ by shape, not by colour alone.
function mark(c, kind, x, y) {
  c.beginPath();
  if (kind === "timer") c.arc(x, y, 3.5, 0, 7);
  else if (kind === "publisher") {
    c.moveTo(x - 3, y - 4);
    c.lineTo(x + 4, y);
    c.lineTo(x - 3, y + 4);
  } else if (kind === "service" || kind === "client") {
    c.moveTo(x, y - 4);
    c.lineTo(x + 4, y);
    c.lineTo(x, y + 4);
    c.lineTo(x - 4, y);
  } else if (kind === "event") {
    c.moveTo(x - 4, y - 4);
    c.lineTo(x + 4, y - 4);
    c.lineTo(x, y + 4);
  } else if (kind === "state") c.rect(x - 4, y - 2, 8, 4);
  else if (kind === "core") {
    c.rect(x - 4, y - 4, 8, 8);
    c.rect(x - 1.5, y - 1.5, 3, 3);
    c.fill("evenodd");
    return;
  } else if (kind === "schedule") {
    c.rect(x - 4, y - 3, 8, 1.5);
    c.rect(x - 4, y - 0.75, 5, 1.5);
    c.rect(x - 4, y + 1.5, 8, 1.5);
  } else if (kind === "thread") {
    c.rect(x - 4, y - 3, 8, 2);
    c.rect(x - 4, y + 1, 8, 2);
  } else c.rect(x - 3.5, y - 3.5, 7, 7);
  c.fill();
}

function hatch(c, x, y, width, height, ink) {
  c.save();
  c.beginPath();
  c.rect(x, y, width, height);
  c.clip();
  c.strokeStyle = ink;
  c.lineWidth = 1;
  c.beginPath();
  for (let at = x - height - ((x - height) % 5); at < x + width && at < x + 4000; at += 5) {
    c.moveTo(at, y + height);
    c.lineTo(at + height, y);
  }
  c.stroke();
  c.restore();
}
