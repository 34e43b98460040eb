// The page with the timeline: its window, what is picked, and how one moves about.

import { clear, h } from "./dom.js";
import { current, go, replace } from "./address.js";
import { inArea, lanesBetween, showArea } from "./area.js";
import { Minimap } from "./minimap.js";
import { missingWords } from "./missing.js";
import { helpDialog } from "./help.js";
import { shortSymbol } from "./symbols.js";
import {
  count,
  duration,
  EVENT,
  IDLE_CPU,
  KIND_NAMES,
  KINDS,
  LINKS,
  MISSING,
  moment,
  partTitle,
  pathText,
  percent,
  PREEMPTED,
  RUNNING,
  stateText,
  wakerName,
  wallClock,
} from "./labels.js";
import { AXIS, Renderer } from "./renderer.js";
import { indexBars, KERNEL_KINDS, KINDS_HIDDEN_FIRST, layout, ROW_KINDS } from "./timeline_rows.js";
import { Counters, counterText } from "./counters.js";
import { NEAR_MARK, nearestMark } from "./marks.js";
import { buildFlow, extent, markCritical } from "./flow.js";
import { besides, scrolls } from "./table.js";
import { downloads } from "./download.js";
import { command, failed, INTERNAL, notes, waiting } from "./notice.js";

const LEAST_SPAN = 20;
const MARGIN = 0.5;
// As many bars as a person can tell apart at once: a longer run opens on so many of it.
const READABLE = 400;
// Events of one callback instance that the list of a flow names.
const MOST_EVENTS = 5;
const MOST_LISTED = 300;

export class TimelinePage {
  constructor(app, root) {
    this.app = app;
    this.root = root;
    this.state = { hidden: new Set(), folded: new Set(), kinds: new Set(), pinned: new Set() };
    this.gathered = true;
    this.withExecutors = false;
    this.requests = 0;
    this.abort = null;
    this.frame = 0;
    this.ready = this.build();
  }

  async build() {
    const run = this.app.run;
    this.length = Math.max(run.length, 1000);
    const asked = current();
    this.canvas = h("canvas", {
      className: "timeline",
      tabIndex: 0,
      role: "application",
      "aria-label":
        "Timeline. Arrow keys move, plus and minus zoom, N and P go to the next and previous bar, F shows all, Escape lets go.",
    });
    this.renderer = new Renderer(this.canvas);
    this.tooltip = h("div", { className: "tooltip", role: "status", hidden: true });
    this.status = h("p", { className: "status", role: "status" });
    this.side = h("aside", { className: "side", hidden: true, "aria-label": "picked flow" });
    this.beside = h("div");
    this.area = h("div", {
      className: "area",
      role: "region",
      "aria-label": "sums of the selected area",
    });
    this.help = helpDialog();
    this.minimap = new Minimap(this.length, (from, to) => this.setView(from, to));
    this.tools();
    clear(
      this.root,
      this.bar,
      this.help,
      h(
        "div",
        { className: "stage" },
        h("div", { className: "canvas-frame" }, this.canvas, this.tooltip),
        this.side,
      ),
      this.minimap.canvas,
      this.status,
      this.area,
      this.legend(),
      this.beside,
    );
    this.listen();
    const chosen = this.app.window;
    this.setView(
      number(asked.from, chosen.start ?? 0),
      number(asked.to, chosen.end ?? this.length),
      false,
    );
    this.isOpening = !this.app.follower?.isFollowing && !asked.from && !asked.to && !asked.flow &&
      chosen.start === undefined && chosen.end === undefined;
    this.state.query = asked.q ?? "";
    this.search.value = this.state.query;
    this.state.internal = asked.internal === "1";
    this.internal.checked = this.state.internal;
    for (const key of (asked.hide ?? "").split(",").filter(Boolean)) this.hideKey(key);
    const wanted = (asked.show ?? "").split(",");
    for (const kind of KINDS_HIDDEN_FIRST) {
      if (!wanted.includes(kind)) this.hideKey(`kind:${kind}`);
    }
    for (const key of (asked.pin ?? "").split(",").filter(Boolean)) {
      this.state.pinned.add(Number(key));
    }
    const [rows, gaps, marks] = await Promise.all([
      this.app.fetch("row"),
      this.app.fetch("gap"),
      this.app.happened(),
    ]);
    this.renderer.marks = this.minimap.marks = marks;
    // Of one flow alone there are no counters.
    this.counters = new Counters(this.app, rows);
    if (!this.app.source.pages) {
      await Promise.all([this.counters.read(0), wanted.includes("rate") && this.counters.read(1)]);
    }
    this.setRows();
    this.renderer.gaps = Array.from({ length: gaps.rows }, (_, row) => ({
      host: gaps.host[row],
      kind: gaps.kind[row],
      at: gaps.start_at[row],
      length: gaps.length[row],
    }));
    await this.kernel();
    this.gapsCut = gaps.rows ? gaps.total[0] - gaps.rows : 0;
    this.relayout();
    await this.load();
    this.overview();
    this.source = asked.source;
    if (asked.flow) await this.pickText(asked.flow, !asked.from);
    // Where only one flow is at hand there is no other one to go to.
    if (this.app.source.pages) this.worst.hidden = true;
    else this.slowest();
  }

  setRows() {
    this.rows = this.counters.withRows();
    this.rowAt = new Map();
    for (let row = 0; row < this.rows.rows; row++) this.rowAt.set(this.rows.row_key[row], row);
  }

  // Rows of a kind that are hidden are not read.
  async showKind(kind) {
    try {
      if (kind === "rate") {
        await this.counters.read(1);
        this.setRows();
        this.relayout();
        await this.load();
      }
    } catch (error) {
      clear(this.status, failed(error));
    }
  }

  // Names, boxes and colours of what only a recording with a kernel trace has.
  async kernel() {
    const isTraced = this.rows.kind.some((kind) => KERNEL_KINDS.has(kind));
    for (const { kind, label } of this.kindBoxes) {
      if (KERNEL_KINDS.has(kind)) label.hidden = !isTraced;
    }
    this.states.hidden = !isTraced;
    if (!isTraced) return;
    const names = await this.app.fetch("thread_name");
    for (let row = 0; row < names.rows; row++) {
      this.renderer.names.set(names.id[row], names.name[row]);
    }
  }

  tools() {
    const button = (label, text, action) =>
      h(
        "button",
        { type: "button", title: label, "aria-label": label, on: { click: action } },
        text,
      );
    this.search = h("input", {
      type: "search",
      placeholder: "node, topic, process …",
      "aria-label": "show rows with this text",
      on: {
        input: () => {
          this.state.query = this.search.value;
          this.remember();
          this.relayout();
          this.redraw();
        },
      },
    });
    this.internal = h("input", {
      type: "checkbox",
      on: {
        change: () => {
          this.state.internal = this.internal.checked;
          this.remember();
          this.relayout();
          this.redraw();
        },
      },
    });
    this.kindBoxes = Object.entries(ROW_KINDS).map(([kind, label]) => {
      const box = h("input", {
        type: "checkbox",
        checked: true,
        on: {
          change: () => {
            if (box.checked) {
              this.state.kinds.delete(kind);
              this.showKind(kind);
            } else this.state.kinds.add(kind);
            this.remember();
            this.relayout();
            this.redraw();
          },
        },
      });
      return { kind, box, label: h("label", {}, box, label) };
    });
    this.measuring = h("button", {
      type: "button",
      "aria-pressed": "false",
      title: "Measure between two points (M, or drag with Shift)",
      on: { click: () => this.toggleMeasure() },
    }, "measure");
    this.worst = h("select", {
      "aria-label": "go to the slowest flow of a path",
      on: { change: () => this.goWorst() },
    }, h("option", { value: "" }, "slowest flow of …"));
    this.unhide = h("button", {
      type: "button",
      hidden: true,
      on: {
        click: () => {
          this.state.hidden.clear();
          this.remember();
          this.relayout();
          this.redraw();
        },
      },
    });
    this.files = downloads({
      name: "timeline",
      canvases: () => [this.canvas],
      columns: () => {
        const bars = this.shown();
        return ["begin_ns", "what", "row", "node", "duration_ns", "identity"].map((
          title,
          place,
        ) => [title, bars.map((bar) => bar[place])]);
      },
    });
    this.bar = h(
      "div",
      { className: "tools" },
      this.search,
      h(
        "span",
        { className: "group" },
        button("Zoom in (+)", "+", () => this.zoom(0.5)),
        button("Zoom out (−)", "−", () => this.zoom(2)),
        button("Show all (F)", "all", () => this.setView(0, this.length)),
      ),
      h(
        "span",
        { className: "group" },
        button("Previous bar of this row (P)", "‹ previous", () => this.step(-1)),
        button("Next bar of this row (N)", "next ›", () => this.step(1)),
      ),
      this.files,
      this.measuring,
      this.worst,
      button("Help (?)", "?", () => this.help.showModal()),
      h(
        "details",
        { className: "menu" },
        h("summary", {}, "rows"),
        h(
          "div",
          { className: "menu-body" },
          this.kindBoxes.map(({ label }) => label),
          h("label", {}, this.internal, INTERNAL),
          this.unhide,
        ),
      ),
    );
  }

  legend() {
    const item = (name, text, shape = "swatch") =>
      h(
        "span",
        { className: "legend-item" },
        h("span", { className: `${shape} color-${name}` }),
        text,
      );
    this.states = h(
      "span",
      { className: "legend-states", hidden: true },
      item("running", "running"),
      item("preempted", "preempted: lost the CPU while it had more to do"),
      item("runnable", "runnable: waits for a CPU"),
      item("wait", "sleeping"),
      item("uninterruptible", "uninterruptible: page or disk"),
      item("soft", "woken by", "stroke dashed"),
    );
    return h(
      "div",
      { className: "legend", "aria-label": "colours" },
      item("timer", "timer callback"),
      item("subscription", "subscription callback"),
      item("service", "service callback"),
      item("publication", "publication"),
      item("take", "take"),
      item("call", "request, response"),
      item("execute", "executor thread: take and callback"),
      item("blocked", "blocked: waits for the executor's lock"),
      item("process", "select: looks for work"),
      item("wait", "wait: for work"),
      item("event", "event of your own"),
      item("active", "managed node: active"),
      item("wait", "not active"),
      item("transport", "publish to take", "stroke"),
      item("direct", "direct link", "stroke"),
      item("indirect", "indirect link", "stroke dashed"),
      item("critical", "critical path", "stroke"),
      item("gap", "not recorded"),
      h(
        "span",
        { className: "legend-item" },
        h("b", {}, "▼"),
        "on the axis: what began, ended, or happened once",
      ),
      this.states,
      h(
        "span",
        { className: "legend-item" },
        h("b", { className: "color-error" }, "✕"),
        "message dropped or lost; grey: not known",
      ),
      h(
        "span",
        { className: "legend-item" },
        "low columns: several bars, as high as their share of the time; hatched: lost events may hide a part",
      ),
    );
  }

  remember() {
    replace({
      page: "timeline",
      from: Math.round(this.renderer.view.from),
      to: Math.round(this.renderer.view.to),
      q: this.state.query,
      internal: this.state.internal ? "1" : null,
      show: KINDS_HIDDEN_FIRST.filter((kind) => !this.state.kinds.has(kind)).join(","),
      hide: [
        ...this.state.hidden,
        ...[...this.state.kinds].filter((kind) => !KINDS_HIDDEN_FIRST.includes(kind))
          .map((kind) => `kind:${kind}`),
        ...this.state.folded,
      ].join(","),
      pin: [...this.state.pinned].join(","),
      flow: this.picked ? `${this.picked.kind}:${this.picked.id}` : null,
      source: this.picked ? this.source : null,
    });
    this.app.linksMoved();
  }

  hideKey(key) {
    if (key.startsWith("kind:")) {
      this.state.kinds.add(key.slice(5));
      for (const { kind, box } of this.kindBoxes) if (kind === key.slice(5)) box.checked = false;
    } else if (key.includes(":")) this.state.folded.add(key);
    else this.state.hidden.add(Number(key));
  }

  relayout() {
    const flow = this.renderer.flow;
    const only = flow && this.gathered ? new Set(flow.vertices.map((vertex) => vertex.row)) : null;
    if (only && this.withExecutors) {
      const processes = new Set([...only].map((key) => this.rows.process_id[this.rowAt.get(key)]));
      for (let row = 0; row < this.rows.rows; row++) {
        if (
          ["thread", "schedule"].includes(this.rows.kind[row]) &&
          processes.has(this.rows.process_id[row])
        ) only.add(this.rows.row_key[row]);
      }
    }
    if (only) { for (const { row } of this.eventsOf(flow)) only.add(row); }
    const made = layout(this.rows, { ...this.state, only, critical: Boolean(flow?.pieces?.rows) });
    this.renderer.lanes = made.lanes;
    this.renderer.height = made.height;
    this.hiddenCount = made.hiddenCount;
    this.unhide.hidden = this.state.hidden.size === 0;
    this.unhide.textContent = `show ${count(this.state.hidden.size, "hidden row")}`;
    const wanted = Math.min(
      Math.max(made.height + AXIS + 8, 260),
      Math.max(innerHeight - 210, 320),
    );
    this.canvas.style.height = `${wanted}px`;
    this.renderer.resize();
    this.scrollTo(this.renderer.scroll);
  }

  // Events of the user in callback instances of the flow, where they are at hand.
  eventsOf(flow) {
    const { bars } = this.renderer;
    const instances = new Set(
      flow.vertices.filter((vertex) => vertex.kind === 0).map((vertex) => vertex.id),
    );
    const found = [];
    for (let place = 0; bars && place < this.rows.rows; place++) {
      if (this.rows.kind[place] !== "event") continue;
      const row = this.rows.row_key[place];
      const [first, last] = bars.ranges.get(row) ?? [0, 0];
      for (let at = first; at < last; at++) {
        const instance = bars.table.id[at];
        if (instances.has(instance)) {
          found.push({ row, instance, name: this.rows.label[place], at: bars.table.start_at[at] });
        }
      }
    }
    return found.sort((a, b) => a.at - b.at);
  }

  scrollTo(y) {
    const { renderer } = this;
    const most = Math.max(renderer.height - (renderer.tall - AXIS) + 4, 0);
    renderer.scroll = Math.min(Math.max(y, 0), most);
    return most;
  }

  setView(from, to, load = true) {
    const span = Math.min(Math.max(to - from, LEAST_SPAN), this.length * 1.2);
    let begin = from;
    if (to - from < LEAST_SPAN) begin = (from + to) / 2 - span / 2;
    begin = Math.min(Math.max(begin, -this.length * 0.1), this.length * 1.1 - span * 0.5);
    this.renderer.view = { from: begin, to: begin + span };
    if (load) {
      this.redraw();
      this.later();
    }
  }

  // Draws what is at hand at once; the server is asked when the window has come to rest.
  later() {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => {
      this.remember();
      if (!this.covers()) this.load();
    }, 80);
  }

  covers() {
    const { held } = this;
    if (!held) return false;
    const { from, to } = this.renderer.view;
    if (held.whole) return true;
    const inside = Math.max(from, 0) >= held.from - 1 && Math.min(to, this.length) <= held.to + 1;
    return inside && (!held.bin || (to - from) / held.bin > 500);
  }

  async load() {
    this.abort?.abort();
    this.abort = new AbortController();
    const { signal } = this.abort;
    const { from, to } = this.renderer.view;
    // A file has all it holds at hand: only a server is asked for more than what is seen.
    const margin = this.app.source.isServed ? (to - from) * MARGIN : 0;
    const params = {
      start: Math.floor(Math.max(from - margin, 0)),
      end: Math.ceil(Math.min(to + margin, this.length + 1)),
    };
    this.status.dataset.busy = "1";
    this.say("reading …");
    try {
      const table = await this.app.fetch("segments", params, signal);
      this.renderer.bars = indexBars(table);
      this.held = {
        from: table.meta.start,
        to: table.meta.end,
        bin: table.meta.bin,
        whole: table.meta.whole,
        count: table.meta.count,
        note: table.meta.note,
      };
      this.renderer.links = null;
      if (this.isOpening && this.openOn(table)) {
        this.isOpening = false;
        await this.load();
        return;
      }
      this.isOpening = false;
      this.redraw();
      this.say();
      this.renderer.counters = await this.counters.within(params.start, params.end, signal);
      this.redraw();
      if (!table.meta.bin) {
        const links = await this.app.fetch("links", params, signal);
        this.renderer.links = links;
        this.linksCut = links.meta.is_cut;
        this.redraw();
      }
      this.say();
      this.tables();
      delete this.status.dataset.busy;
    } catch (error) {
      if (error.name === "AbortError") return;
      delete this.status.dataset.busy;
      clear(this.status, failed(error));
    }
  }

  async overview() {
    try {
      this.minimap.fill(await this.app.fetch("segments", { start: 0, end: this.length + 1 }));
    } catch (error) {
      clear(this.status, failed(error));
    }
  }

  // A long run opens where its longest callback is. Tells whether the window is another one now.
  openOn(table) {
    const { count: bars, start, end } = table.meta;
    if (bars <= 4 * READABLE) return false;
    let longest = -1;
    const weight = (
      row,
    ) => (table.count?.[row] > 1 ? table.busy[row] / table.count[row] : table.length[row]);
    for (let row = 0; row < table.rows; row++) {
      if (table.kind[row] === 0 && (longest < 0 || weight(row) > weight(longest))) longest = row;
    }
    if (longest < 0) return false;
    const span = Math.max(((end - start) * READABLE) / bars, 2 * weight(longest));
    const middle = table.start_at[longest] + table.length[longest] / 2;
    if (span > (end - start) / 2) return false;
    this.setView(
      Math.min(Math.max(middle - span / 2, start), end - span),
      Math.min(Math.max(middle + span / 2, start + span), end),
      false,
    );
    this.opened = { ...this.renderer.view };
    return true;
  }

  say(text) {
    if (text) {
      clear(this.status, text);
      return;
    }
    const parts = [];
    const { held, renderer } = this;
    if (held) {
      const number = count(held.count, "bar");
      if (held.bin) {
        parts.push(
          `${number} here: those shorter than ${
            duration(held.bin)
          } are counted in bins of that length, arrows are left out. Zoom in to see them one by one.`,
        );
      } else {parts.push(
          held.whole ? `${number}, all one by one.` : `${number} loaded, all one by one.`,
        );}
      if (held.note) parts.push(held.note);
    }
    if (renderer.links && renderer.linkCount > 1500 && !renderer.flow) {
      parts.push(`${count(renderer.linkCount, "arrow")} not drawn: zoom in, or pick a message.`);
    }
    if (this.linksCut) parts.push("Only a part of the arrows is loaded: zoom in.");
    if (this.gapsCut) {
      parts.push(`${count(this.gapsCut, "shorter gap")} of the recording not shaded.`);
    }
    if (this.hiddenCount && !renderer.flow) parts.push(`${count(this.hiddenCount, "row")} hidden.`);
    if (held && !renderer.flow) {
      parts.push(
        "A click on a bar shows what led to it and what came of it; dragging moves, Ctrl and the wheel zoom.",
      );
    }
    const isOpened = this.opened && this.opened.from === renderer.view.from &&
      this.opened.to === renderer.view.to && !renderer.flow;
    clear(
      this.status,
      isOpened &&
        [
          `These ${duration(this.opened.to - this.opened.from)} of ${
            duration(this.length)
          } are around the longest callback. `,
          h("button", {
            type: "button",
            className: "whole",
            on: { click: () => this.setView(0, this.length) },
          }, "show the whole run"),
          " ",
        ],
      parts.join(" "),
    );
  }

  redraw() {
    if (this.frame) return;
    this.frame = requestAnimationFrame(() => {
      this.frame = 0;
      const before = performance.now();
      this.renderer.draw();
      this.minimap.draw(this.renderer.view);
      this.app.drawn(performance.now() - before);
    });
  }

  zoom(factor, center = null) {
    const { from, to } = this.renderer.view;
    const at = center ?? this.anchor();
    this.setView(at - (at - from) * factor, at + (to - at) * factor);
  }

  anchor() {
    const { from, to } = this.renderer.view;
    const picked = this.renderer.flow?.vertices.find((vertex) => vertex.picked);
    return picked && picked.at >= from && picked.at <= to ? picked.at : (from + to) / 2;
  }

  pan(share) {
    const { from, to } = this.renderer.view;
    const by = (to - from) * share;
    this.setView(from + by, to + by);
  }

  listen() {
    const { canvas, renderer } = this;
    const place = (event) => {
      const box = canvas.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    const pointers = new Map();
    let drag = null;
    canvas.addEventListener("wheel", (event) => {
      const [x] = place(event);
      if (event.ctrlKey || event.metaKey) {
        event.preventDefault();
        this.zoom(Math.exp(event.deltaY * 0.003), renderer.time(Math.max(x, renderer.labelWidth)));
      } else if (event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY)) {
        event.preventDefault();
        this.pan((event.deltaX || event.deltaY) / renderer.plotWidth);
      } else {
        const before = renderer.scroll;
        this.scrollTo(before + event.deltaY);
        if (renderer.scroll !== before) {
          event.preventDefault();
          this.redraw();
        }
      }
    }, { passive: false });
    canvas.addEventListener("pointerdown", (event) => {
      const [x, y] = place(event);
      pointers.set(event.pointerId, [x, y]);
      canvas.setPointerCapture(event.pointerId);
      if (pointers.size === 2) {
        const [[ax], [bx]] = [...pointers.values()];
        drag = {
          pinch: Math.abs(ax - bx) || 1,
          center: renderer.time((ax + bx) / 2),
          view: { ...renderer.view },
        };
        return;
      }
      const measure = event.shiftKey || this.isMeasuring;
      drag = {
        x,
        y,
        view: { ...renderer.view },
        scroll: renderer.scroll,
        measure,
        axis: y < AXIS,
        moved: false,
      };
      if (measure) {
        renderer.measure = { from: renderer.time(x), to: renderer.time(x), top: 0, bottom: 0 };
      }
    });
    canvas.addEventListener("pointermove", (event) => {
      const [x, y] = place(event);
      if (pointers.has(event.pointerId)) pointers.set(event.pointerId, [x, y]);
      if (drag?.pinch && pointers.size === 2) {
        const [[ax], [bx]] = [...pointers.values()];
        const factor = drag.pinch / (Math.abs(ax - bx) || 1);
        const { from, to } = drag.view;
        this.setView(
          drag.center - (drag.center - from) * factor,
          drag.center + (to - drag.center) * factor,
        );
        return;
      }
      if (drag && !drag.pinch) {
        if (Math.hypot(x - drag.x, y - drag.y) > 4) drag.moved = true;
        if (!drag.moved) return;
        if (drag.measure || drag.axis) {
          const height = (at) => at - AXIS + renderer.scroll;
          const rows = drag.axis ? [0, 0] : [height(drag.y), height(y)];
          renderer.measure = {
            from: renderer.time(drag.x),
            to: renderer.time(x),
            top: rows[0],
            bottom: rows[1],
          };
        } else {
          const by = ((drag.x - x) / renderer.plotWidth) * (drag.view.to - drag.view.from);
          this.scrollTo(drag.scroll + drag.y - y);
          this.setView(drag.view.from + by, drag.view.to + by);
        }
        this.redraw();
        return;
      }
      this.hoverAt(x, y);
    });
    const up = (event) => {
      const [x, y] = place(event);
      pointers.delete(event.pointerId);
      const ended = drag;
      if (!pointers.size) drag = null;
      if (!ended || ended.pinch) return;
      if (ended.axis && ended.moved) {
        const { from, to } = renderer.measure;
        renderer.measure = null;
        this.setView(Math.min(from, to), Math.max(from, to));
      } else if (ended.measure && ended.moved) this.sumUp();
      else if (!ended.moved && event.type === "pointerup") this.click(x, y);
    };
    canvas.addEventListener("pointerup", up);
    canvas.addEventListener("pointercancel", up);
    canvas.addEventListener("pointerleave", () => {
      this.tooltip.hidden = true;
      renderer.hover = null;
    });
    canvas.addEventListener("dblclick", (event) => {
      const [x, y] = place(event);
      const hit = renderer.pick(x, y);
      if (hit?.length) this.setView(hit.at - hit.length * 0.5, hit.at + hit.length * 1.5);
      else if (x > renderer.labelWidth) this.zoom(0.25, renderer.time(x));
    });
    this.onKey = (event) => this.key(event);
    addEventListener("keydown", this.onKey);
    this.onResize = () => {
      if (this.rows) {
        this.relayout();
        this.redraw();
      }
    };
    addEventListener("resize", this.onResize);
    this.scheme = matchMedia("(prefers-color-scheme: dark)");
    this.scheme.addEventListener("change", this.onResize);
  }

  leave() {
    removeEventListener("keydown", this.onKey);
    removeEventListener("resize", this.onResize);
    this.scheme?.removeEventListener("change", this.onResize);
    this.abort?.abort();
    clearTimeout(this.timer);
  }

  recolor() {
    if (this.rows) {
      this.renderer.resize();
      this.redraw();
    }
  }

  key(event) {
    if (this.help.open) return;
    if (event.target instanceof HTMLInputElement || event.target instanceof HTMLSelectElement) {
      if (event.key === "Escape") event.target.blur();
      return;
    }
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const actions = {
      ArrowLeft: () => this.pan(-0.2),
      ArrowRight: () => this.pan(0.2),
      a: () => this.pan(-0.2),
      d: () => this.pan(0.2),
      ArrowUp: () => {
        this.scrollTo(this.renderer.scroll - 60);
        this.redraw();
      },
      ArrowDown: () => {
        this.scrollTo(this.renderer.scroll + 60);
        this.redraw();
      },
      "+": () => this.zoom(0.5),
      "=": () => this.zoom(0.5),
      w: () => this.zoom(0.5),
      "-": () => this.zoom(2),
      s: () => this.zoom(2),
      f: () => this.setView(0, this.length),
      n: () => this.step(1),
      p: () => this.step(-1),
      m: () => this.toggleMeasure(),
      "/": () => this.search.focus(),
      "?": () => this.help.showModal(),
      b: () => this.pin(),
      Escape: () => this.letGo(),
    };
    const isArrow = event.key.startsWith("Arrow");
    if (
      isArrow && document.activeElement !== this.canvas && document.activeElement !== document.body
    ) return;
    const action = actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  toggleMeasure() {
    this.isMeasuring = !this.isMeasuring;
    this.measuring.setAttribute("aria-pressed", String(this.isMeasuring));
    if (!this.isMeasuring) {
      this.renderer.measure = null;
      clear(this.area);
      this.redraw();
    }
  }

  // What was measured is summed up: the callbacks and threads of its rows, in its time.
  sumUp() {
    const { from, to, top, bottom } = this.renderer.measure;
    const lanes = lanesBetween(this.renderer.lanes, top, bottom);
    showArea(this.area, this.app, {
      from: Math.max(Math.min(from, to), 0),
      to: Math.min(Math.max(from, to), this.length),
      ...inArea(lanes, this.rows),
    });
  }

  letGo() {
    if (this.renderer.measure) {
      this.renderer.measure = null;
      clear(this.area);
      this.redraw();
      return;
    }
    this.drop();
  }

  // What happened at the moment under the pointer, where it is on the axis.
  markAt(x, y) {
    const { from, to } = this.renderer.view;
    if (y >= AXIS || x < this.renderer.labelWidth) return null;
    const near = (NEAR_MARK * (to - from)) / this.renderer.plotWidth;
    return nearestMark(this.renderer.marks, this.renderer.time(x), near);
  }

  hoverAt(x, y) {
    const mark = this.markAt(x, y);
    if (mark) {
      this.tip(h("span", {}, mark.text), x, AXIS, 0);
      return;
    }
    const hit = this.renderer.pick(x, y);
    if (hit?.lane !== this.renderer.hover?.lane) {
      this.renderer.hover = hit ? { lane: hit.lane } : null;
      this.redraw();
    }
    this.canvas.style.cursor = hit?.kind !== undefined
      ? "pointer"
      : x < this.renderer.labelWidth
      ? "pointer"
      : "grab";
    if (!hit || (hit.lane.type !== "row" && hit.piece === undefined) || y < AXIS) {
      this.tooltip.hidden = true;
      return;
    }
    this.tip(
      hit.piece === undefined ? this.describe(hit, x) : this.describePiece(hit.piece),
      x,
      AXIS + hit.lane.y - this.renderer.scroll,
      hit.lane.height,
    );
  }

  // Shows a tooltip for a row, given its height and where it lies.
  tip(content, x, row, height) {
    clear(this.tooltip, content);
    this.tooltip.hidden = false;
    const box = this.tooltip.getBoundingClientRect();
    // Below the row or above it, never over its bars; where neither has room, beside the pointer.
    const [above, below] = [row - box.height - 4, row + height + 4];
    const frame = this.canvas.getBoundingClientRect();
    const isBelow = frame.top + below + box.height <= innerHeight || frame.top + above < 0;
    const within = (at, room, size) => `${Math.max(Math.min(at, room - size - 6), 2)}px`;
    this.tooltip.style.left = within(frame.left + x + 14, document.body.clientWidth, box.width);
    this.tooltip.style.top = within(frame.top + (isBelow ? below : above), innerHeight, box.height);
  }

  describePiece(row) {
    const { pieces } = this.renderer.flow;
    const state = pieces.state?.[row];
    return [
      h("strong", {}, partTitle(pieces.activity[row])),
      state &&
      h(
        "span",
        {},
        `${pieces.wakers?.[row] ? "" : `${pieces.thread[row] ?? "its thread"}: `}${
          stateText(state, pieces.who[row], pieces.wakers?.[row])
        }`,
      ),
      h("span", {}, `${pieces.what[row] ?? ""} · ${pieces.node[row] ?? ""}`),
      h(
        "span",
        {},
        `${duration(pieces.duration_ns[row])}, ${percent(pieces.share[row])} of the latency`,
      ),
      h("span", {}, `begins at ${moment(pieces.from_ns[row])}`),
      pieces.is_certain[row] === false &&
      h("span", { className: "soft" }, "what waited may have come during it"),
    ].filter(Boolean);
  }

  describe(hit, x) {
    const { lane } = hit;
    const row = lane.row;
    const rows = this.rows;
    const lines = [
      h("strong", {}, lane.label),
      h("span", {}, `${rows.node[row] ?? rows.process[row]} · ${lane.kind}`),
      h("span", { className: "soft" }, `${rows.process[row]} on ${rows.host[row]}`),
    ];
    if (rows.symbol[row]) {
      lines.push(h("span", { className: "symbol" }, shortSymbol(rows.symbol[row])));
    }
    if (lane.isCounter && typeof hit.value === "number") {
      lines.push(h("span", {}, counterText(lane.kind, hit.value)));
    }
    if (hit.kind === undefined) {
      if (x > this.renderer.labelWidth) {
        lines.push(h("span", { className: "soft" }, moment(this.renderer.time(x))));
      }
      return lines;
    }
    if (hit.isBin) {
      lines.push(
        h(
          "span",
          {},
          `${count(hit.count, KINDS[hit.kind])} in ${duration(hit.length)}, ${
            duration(hit.busy)
          } in all (${percent(hit.busy / hit.length)})`,
        ),
      );
    } else {
      const end = hit.flags & 2 ? "end not seen" : duration(hit.length);
      if (hit.kind === MISSING) {
        lines.push(
          h("span", { className: "warn" }, `message ${hit.id} ${missingWords(hit.flags)}`),
        );
      } else if (hit.kind === EVENT) {
        lines.push(
          h(
            "span",
            {},
            hit.id >= 0 ? `event in callback instance ${hit.id}` : "event in no callback",
          ),
        );
      } else if (hit.kind >= RUNNING) lines.push(h("span", {}, `${this.kernelText(hit)}: ${end}`));
      else {lines.push(
          h("span", {}, `${KINDS[hit.kind]}${hit.id >= 0 ? ` ${hit.id}` : ""}: ${end}`),
        );}
      if (hit.together > 1) lines.push(h("span", {}, `one of ${hit.together} in this column`));
    }
    lines.push(h("span", {}, `begins at ${moment(hit.at)}`));
    const wall = wallClock(this.app.run.start_text, hit.at);
    if (wall) lines.push(h("span", { className: "soft" }, wall));
    if (hit.flags & 1) {
      lines.push(h("span", { className: "warn" }, "lost events may hide a part of it"));
    }
    if (hit.kind >= RUNNING) return lines;
    if (hit.flags & 4) {
      lines.push(h("span", { className: "soft" }, "message from the same process"));
    }
    if (hit.flags & 8) lines.push(h("span", { className: "soft" }, "runs inside another callback"));
    return lines;
  }

  // What a thread did, or what a core ran, with the name of what took the CPU or woke the thread.
  kernelText(hit) {
    const name = this.renderer.names.get(hit.id);
    if (hit.lane.kind === "core") {
      if (hit.kind === RUNNING) return `${name ?? "?"} runs`;
      return name === IDLE_CPU
        ? "idle, while a thread is ready"
        : `${name ?? "another thread"} took it`;
    }
    const woken = hit.kind > PREEMPTED;
    return stateText(KINDS[hit.kind], woken ? wakerName(hit.flags, name) : name);
  }

  click(x, y) {
    const hit = this.renderer.pick(x, y);
    if (!hit) {
      if (y >= AXIS) this.drop();
      return;
    }
    if (hit.lane.type !== "row") {
      const { piece } = hit;
      if (piece !== undefined) {
        this.centerAt(
          this.renderer.flow.pieces.from_ns[piece],
          this.renderer.flow.pieces.duration_ns[piece],
        );
      } else if (x < this.renderer.labelWidth && hit.lane.type !== "critical") {
        this.fold(hit.lane.key);
      }
      return;
    }
    if (x < this.renderer.labelWidth) {
      if (!this.renderer.flow) {
        this.state.hidden.add(hit.lane.key);
        this.remember();
        this.relayout();
        this.redraw();
        this.say();
      }
      return;
    }
    if (hit.kind === undefined) return;
    if (hit.isBin) {
      this.setView(hit.at, hit.at + hit.length);
      return;
    }
    if (hit.kind >= RUNNING) {
      this.centerAt(hit.at, hit.length);
      return;
    }
    const kind = hit.kind === MISSING
      ? "publication"
      : hit.kind >= 5
      ? "callback_instance"
      : KIND_NAMES[hit.kind];
    if (hit.id < 0) return;
    this.source = null;
    this.pick({ kind, id: hit.id }, false);
  }

  fold(key) {
    if (this.state.folded.has(key)) this.state.folded.delete(key);
    else this.state.folded.add(key);
    this.remember();
    this.relayout();
    this.redraw();
  }

  pickText(text, show, source = this.source) {
    this.source = source;
    const [kind, id] = text.split(":");
    if (!KIND_NAMES.includes(kind) || !/^\d+$/.test(id ?? "")) return undefined;
    return this.pick({ kind, id: Number(id) }, show);
  }

  async pick(picked, show) {
    const asked = ++this.requests;
    this.side.hidden = false;
    clear(this.side, waiting("following the message …"));
    this.renderer.resize();
    this.redraw();
    try {
      const table = await this.app.fetch("flow", picked);
      if (asked !== this.requests) return;
      if (!table.rows) throw new Error(`there is no ${picked.kind} ${picked.id}`);
      this.picked = picked;
      this.renderer.flow = buildFlow(table, picked);
      if (show) {
        const { from, to } = extent(this.renderer.flow);
        const span = Math.max(to - from, 1000);
        this.setView(from - span * 0.08, to + span * 0.08);
      }
      this.remember();
      this.relayout();
      this.redraw();
      this.showSide();
      this.say();
      this.findCritical(asked);
    } catch (error) {
      if (asked === this.requests) clear(this.side, failed(error));
    }
  }

  // What the flow waited for takes longer to find than the flow, and comes when it is known.
  async findCritical(asked) {
    const { flow } = this.renderer;
    try {
      const pieces = await this.app.fetch("critical", { ...this.picked, from: this.source });
      if (asked !== this.requests) return;
      markCritical(flow, pieces);
      this.relayout();
      this.redraw();
      this.showSide();
    } catch (error) {
      if (asked !== this.requests || error.name === "AbortError") return;
      clear(
        this.critical,
        this.app.source.isServed ? failed(error) : h(
          "p",
          { className: "soft" },
          "The critical path is in this report for its slowest flows alone; msgflow ui marks it, and msgflow flow --why prints it.",
        ),
      );
    }
  }

  // The pieces of the critical path, as the query gives them.
  pieces() {
    const { pieces } = this.renderer.flow;
    if (!pieces) return waiting("looking for what it waited for …");
    if (!pieces.rows) {
      return h(
        "p",
        { className: "soft" },
        "No path leads to where this flow ends: there is no critical path.",
      );
    }
    const rows = Array.from(
      { length: pieces.rows },
      (_, row) =>
        h(
          "tr",
          {
            className: "can-pick",
            on: { click: () => this.centerAt(pieces.from_ns[row], pieces.duration_ns[row]) },
          },
          h("td", { className: "number" }, `+${duration(pieces.at_ns[row])}`),
          h(
            "td",
            {},
            h("button", { type: "button", className: "pick" }, partTitle(pieces.activity[row])),
            pieces.state?.[row] &&
              h("div", {}, stateText(pieces.state[row], pieces.who[row], pieces.wakers?.[row])),
            h(
              "div",
              { className: "soft" },
              `${pieces.what[row] ?? ""} · ${pieces.node[row] ?? ""}`,
            ),
          ),
          h("td", { className: "number" }, duration(pieces.duration_ns[row])),
        ),
    );
    return [
      h(
        "p",
        {},
        `${
          duration(pieces.latency_ns[0])
        } from ${pieces.meta.from} to ${pieces.meta.to}, take ${pieces.meta.take_id}: the longest flow that ends with it, and what it waited for.`,
      ),
      besides(
        count(pieces.rows, "piece"),
        scrolls(
          "pieces of the critical path",
          h(
            "table",
            { className: "steps-critical" },
            h(
              "thead",
              {},
              h("tr", {}, ["at", "what", "took"].map((text) => h("th", { scope: "col" }, text))),
            ),
            h("tbody", {}, rows),
          ),
        ),
        command(pieces.meta.command),
        notes(pieces.meta.notes),
      ),
    ];
  }

  centerAt(at, length) {
    const span = Math.max(length * 1.5, 1000);
    this.setView(at - (span - length) / 2, at + length + (span - length) / 2);
  }

  // A pinned row stays at the top, so that it can be compared with rows far below.
  pin() {
    const key = this.renderer.hover?.lane?.key;
    if (typeof key !== "number") {
      this.say("Point at a row first: B pins it to the top.");
      return;
    }
    if (this.state.pinned.has(key)) this.state.pinned.delete(key);
    else this.state.pinned.add(key);
    this.remember();
    this.relayout();
    this.redraw();
  }

  drop() {
    this.requests++;
    this.picked = null;
    this.renderer.flow = null;
    this.side.hidden = true;
    this.remember();
    this.relayout();
    this.redraw();
  }

  showSide() {
    const { flow } = this.renderer;
    this.critical = h("div", {}, this.pieces());
    const gather = h("input", {
      type: "checkbox",
      checked: this.gathered,
      on: {
        change: () => {
          this.gathered = gather.checked;
          this.relayout();
          this.redraw();
        },
      },
    });
    const executors = h("input", {
      type: "checkbox",
      checked: this.withExecutors,
      on: {
        change: () => {
          this.withExecutors = executors.checked;
          this.relayout();
          this.redraw();
        },
      },
    });
    const { from, to } = extent(flow);
    const events = new Map();
    for (const event of this.eventsOf(flow)) {
      events.set(event.instance, [...(events.get(event.instance) ?? []), event]);
    }
    const inward = new Map();
    for (const edge of flow.edges) if (!inward.has(edge.to)) inward.set(edge.to, edge);
    const rows = flow.vertices.map((vertex, place) => {
      const row = this.rowAt.get(vertex.row);
      const edge = inward.get(place);
      const lead = edge
        ? vertex.at -
          (edge.kind === "direct"
            ? vertex.at
            : flow.vertices[edge.from].at + flow.vertices[edge.from].length)
        : null;
      return h(
        "tr",
        {
          className: `can-pick${vertex.critical ? " is-critical" : ""}`,
          "aria-selected": vertex.picked ? "true" : undefined,
          data: { kind: KIND_NAMES[vertex.kind], id: String(vertex.id) },
          on: { click: () => this.center(vertex) },
        },
        h("td", { className: "number" }, `+${duration(vertex.at - from)}`),
        h(
          "td",
          {},
          h(
            "button",
            { type: "button", className: "pick" },
            row === undefined ? "?" : this.rows.label[row],
          ),
          h(
            "div",
            { className: "soft" },
            `${KINDS[vertex.kind]} · ${
              row === undefined ? "" : this.rows.node[row] ?? this.rows.process[row]
            }`,
          ),
          edge && edge.kind !== "callback" &&
            h(
              "div",
              { className: "soft" },
              `${LINKS[edge.kind]}${lead ? `, after ${duration(lead)}` : ""}`,
            ),
          vertex.kind === 0 && eventLines(events.get(vertex.id) ?? [], from),
        ),
        h(
          "td",
          { className: "number" },
          vertex.flags & 2 ? "end not seen" : vertex.length ? duration(vertex.length) : "",
        ),
      );
    });
    const causes = flow.vertices.filter((vertex) => vertex.isCause && !vertex.picked).length;
    const effects = flow.vertices.filter((vertex) => vertex.isEffect && !vertex.picked).length;
    clear(
      this.side,
      h(
        "div",
        { className: "side-head" },
        h("h2", {}, "Flow"),
        h("button", {
          type: "button",
          title: "let go (Escape)",
          "aria-label": "let go of the flow",
          on: { click: () => this.drop() },
        }, "✕"),
      ),
      h(
        "p",
        {},
        `${this.picked.kind.replace("_", " ")} ${this.picked.id}: ${count(causes, "cause")}, ${
          count(effects, "effect")
        }, ${duration(to - from)} in all.`,
      ),
      flow.leftOut > 0 &&
        h(
          "p",
          { className: "warn" },
          `${count(flow.leftOut, "step")} farther away in time left out.`,
        ),
      flow.outside > 0 &&
        h(
          "p",
          { className: "warn" },
          `The flow goes on at ${count(flow.outside, "place")} outside of what this report holds.`,
        ),
      h(
        "p",
        {},
        h("label", {}, gather, "only rows of the flow"),
        " ",
        h("label", {}, executors, "and their executors"),
        " ",
        h("button", {
          type: "button",
          on: {
            click: () => {
              const span = Math.max(to - from, 1000);
              this.setView(from - span * 0.08, to + span * 0.08);
            },
          },
        }, "show all of it"),
      ),
      scrolls(
        "steps of the flow",
        h(
          "table",
          { className: "steps" },
          h(
            "thead",
            {},
            h("tr", {}, ["at", "what", "took"].map((text) => h("th", { scope: "col" }, text))),
          ),
          h("tbody", {}, rows),
        ),
      ),
      h("h3", { className: "critical-title" }, "Critical path"),
      this.critical,
    );
    this.renderer.resize();
    this.redraw();
  }

  center(vertex) {
    const { from, to } = this.renderer.view;
    const span = to - from;
    const middle = vertex.at + vertex.length / 2;
    this.setView(middle - span / 2, middle + span / 2);
    const lane = this.renderer.lanes.find((known) => known.key === vertex.row);
    if (lane) this.scrollTo(lane.y - this.renderer.tall / 3);
  }

  async step(by) {
    const picked = this.renderer.flow?.vertices.find((vertex) => vertex.picked);
    if (!picked) {
      this.say("Pick a bar first: next and previous are those of its row.");
      return;
    }
    try {
      const found = await this.app.fetch("neighbour", {
        row: picked.row,
        kind: picked.kind,
        id: picked.id,
        step: by,
      });
      if (!found.rows) {
        this.say(`There is no ${by > 0 ? "next" : "previous"} one on this row.`);
        return;
      }
      const { from, to } = this.renderer.view;
      const at = found.start_at[0];
      if (at < from || at + found.length[0] > to) {
        this.setView(at - (to - from) / 2, at + (to - from) / 2);
      }
      this.source = null;
      await this.pick({ kind: KIND_NAMES[found.kind[0]], id: found.id[0] }, false);
    } catch (error) {
      clear(this.status, failed(error));
    }
  }

  // Paths are looked for when the timeline stands: that may take longer than drawing it.
  slowest() {
    const fill = async () => {
      this.worst.removeEventListener("pointerdown", fill);
      this.worst.removeEventListener("focus", fill);
      if (this.worst.options.length > 1) return;
      try {
        const [paths, worst] = await Promise.all([
          this.app.fetch("path"),
          this.app.fetch("path_slowest", { limit: 1 }),
        ]);
        const names = new Map(
          Array.from({ length: paths.rows }, (_, row) => [paths.path_id[row], paths.path[row]]),
        );
        const sources = new Map(
          Array.from(
            { length: paths.rows },
            (_, row) => [paths.path_id[row], paths.topics[row][0]],
          ),
        );
        for (let row = 0; row < worst.rows; row++) {
          const value = Number.isNaN(worst.take_id[row])
            ? `${worst.root_kind[row]}:${worst.root_id[row]}`
            : `take:${worst.take_id[row]}`;
          this.worst.append(
            h(
              "option",
              { value, data: { source: sources.get(worst.path_id[row]) ?? "" } },
              `${duration(worst.latency[row])}  ${pathText(names.get(worst.path_id[row]))}`,
            ),
          );
        }
        if (!worst.rows) {
          this.worst.append(h("option", { disabled: true }, "no path has a flow that arrived"));
        }
      } catch (error) {
        clear(this.status, failed(error));
      }
    };
    this.worst.addEventListener("pointerdown", fill);
    this.worst.addEventListener("focus", fill);
  }

  goWorst() {
    if (this.worst.value) {
      this.pickText(this.worst.value, true, this.worst.selectedOptions[0].dataset.source);
    }
    this.worst.selectedIndex = 0;
  }

  // The bars in the window: each a row of values.
  shown() {
    const { table, ranges } = this.renderer.bars;
    const { from, to } = this.renderer.view;
    const found = [];
    for (const lane of this.renderer.lanes) {
      const [first, last] = ranges.get(lane.key) ?? [0, 0];
      for (let at = first; at < last; at++) {
        if (table.start_at[at] > to || table.start_at[at] + table.length[at] < from) continue;
        found.push([
          table.start_at[at],
          KINDS[table.kind[at]],
          lane.label,
          this.rows.node[lane.row] ?? this.rows.process[lane.row],
          table.length[at],
          table.count?.[at] > 1
            ? `${table.count[at]} together`
            : table.id[at] >= 0
            ? table.id[at]
            : "",
        ]);
      }
    }
    return found;
  }

  tables() {
    const list = h("div");
    const fill = () => {
      const bars = this.shown();
      const more = bars.length - MOST_LISTED;
      const rows = bars.slice(0, MOST_LISTED).map(([begin, kind, label, node, length, identity]) =>
        h(
          "tr",
          {},
          h("td", { className: "number" }, moment(begin)),
          h("td", {}, kind),
          h("td", {}, label),
          h("td", {}, node),
          h("td", { className: "number" }, duration(length)),
          h("td", { className: "number" }, identity),
        )
      );
      clear(
        list,
        scrolls(
          "bars in the window",
          h(
            "table",
            {},
            h(
              "thead",
              {},
              h(
                "tr",
                {},
                ["begin", "what", "row", "node", "duration", "identity"].map((text) =>
                  h("th", { scope: "col" }, text)
                ),
              ),
            ),
            h("tbody", {}, rows),
          ),
        ),
        more > 0
          ? h("p", { className: "soft" }, `${count(more, "further bar")} in the window: zoom in.`)
          : null,
      );
    };
    const details = besides("the window as a table", list);
    details.addEventListener("toggle", () => {
      if (details.open) fill();
    });
    clear(this.beside, details);
  }
}

function eventLines(events, from) {
  const lines = events.slice(0, MOST_EVENTS).map(({ name, at }) =>
    `${name} at +${duration(at - from)}`
  );
  if (events.length > MOST_EVENTS) {
    lines.push(`and ${count(events.length - MOST_EVENTS, "more event")}`);
  }
  return lines.map((line) => h("div", { className: "soft" }, line));
}

function number(text, fallback) {
  const value = Number(text);
  return text === undefined || text === "" || !Number.isFinite(value) ? fallback : value;
}
