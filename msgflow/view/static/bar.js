// The bar on all pages: window of time, search, rows of ROS itself, and a link to what is shown.

import { breakable, clear, color, h } from "./dom.js";
import { current, go, pageAddress } from "./address.js";
import { duration, momentOf, secondsText, usualMost } from "./labels.js";
import { INTERNAL } from "./notice.js";
import { NEAR_MARK, nearestMark } from "./marks.js";

// A shorter drag on the curve is a click.
const LEAST_DRAG = 4;
const MOST_FOUND = 8;
// Pages whose numbers are of whole runs, or of what a query says.
const WITHOUT_WINDOW = ["compare", "sql", "what_if"];
const HOW_TO_CHOOSE = "drag to choose a window of time; a click shows the whole run";
const FOUND_ON = {
  node: ["nodes", "q"],
  namespace: ["nodes", "q"],
  topic: ["topics", "topic"],
  service: ["nodes", "q"],
};

export class Bar {
  constructor(app, root) {
    this.app = app;
    this.canvas = h("canvas", {
      className: "rate",
      role: "img",
      "aria-label": "how much happened over time: drag to choose a window of time",
      title: HOW_TO_CHOOSE,
    });
    const edge = (label) =>
      h("input", {
        type: "text",
        inputMode: "decimal",
        size: 9,
        "aria-label": label,
        placeholder: label,
        on: { change: () => this.typed() },
      });
    this.from = edge("from [s]");
    this.to = edge("to [s]");
    this.wholeRun = h(
      "button",
      { type: "button", on: { click: () => this.choose(null, null) } },
      "whole run",
    );
    this.warmUp = h("button", {
      type: "button",
      title: "begin after the warm-up, where compare finds one",
      on: { click: () => this.skipWarmUp() },
    }, "skip warm-up");
    this.said = h("span", { className: "bar-said soft", role: "status" });
    this.search = h("input", {
      type: "search",
      placeholder: "find a node, topic, 3.25 s …",
      "aria-label": "find a node, topic, namespace, service or moment",
      autocomplete: "off",
      on: {
        input: () => {
          this.finding = this.find();
        },
        focus: () => {
          this.finding = this.find();
        },
        keydown: (event) => this.keyDown(event),
      },
    });
    this.found = h("div", { className: "found", hidden: true });
    this.internal = h("input", {
      type: "checkbox",
      className: "internal",
      on: { change: () => go({ internal: this.internal.checked ? "1" : null }) },
    });
    this.copy = h("button", {
      type: "button",
      title: "copy a link to what is shown",
      on: { click: () => this.copyLink() },
    }, "copy link");
    this.time = h(
      "div",
      { className: "bar-time" },
      this.canvas,
      h("div", { className: "group" }, this.from, "–", this.to, this.wholeRun, this.warmUp),
      this.said,
    );
    const search = h("div", { className: "bar-search" }, this.search, this.found);
    search.addEventListener("focusout", (event) => {
      if (!search.contains(event.relatedTarget)) this.found.hidden = true;
    });
    clear(
      root,
      app.source.isServed && this.time,
      search,
      app.source.isServed && h("label", {}, this.internal, INTERNAL),
      this.copy,
    );
    if (app.source.isServed) this.listen();
  }

  listen() {
    const at = (event) => {
      const box = this.canvas.getBoundingClientRect();
      return Math.round(
        Math.min(Math.max((event.clientX - box.left) / box.width, 0), 1) *
          (this.app.run.length + 1),
      );
    };
    this.canvas.addEventListener("pointerdown", (event) => {
      this.canvas.setPointerCapture(event.pointerId);
      this.drag = { x: event.clientX, from: at(event), to: at(event) };
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (!this.drag) {
        const near = (NEAR_MARK / this.canvas.clientWidth) * this.app.run.length;
        this.canvas.title = nearestMark(this.marks, at(event), near)?.text ?? HOW_TO_CHOOSE;
        return;
      }
      this.drag.to = at(event);
      this.draw();
    });
    this.canvas.addEventListener("pointerup", (event) => {
      const { drag } = this;
      this.drag = null;
      if (!drag) return;
      if (Math.abs(event.clientX - drag.x) < LEAST_DRAG) this.choose(null, null);
      else this.choose(Math.min(drag.from, at(event)), Math.max(drag.from, at(event)));
    });
    this.canvas.addEventListener("pointercancel", () => {
      this.drag = null;
      this.draw();
    });
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  // What is shown has changed: another page, window or run.
  update() {
    const { app } = this;
    this.time.hidden = WITHOUT_WINDOW.includes(current().page);
    this.internal.checked = app.internal;
    if (!app.source.isServed || !app.run?.start_text) return;
    const { start, end } = app.window;
    this.write(this.from, start);
    this.write(this.to, end);
    if (this.isInternal !== app.internal) {
      this.isInternal = app.internal;
      this.places = null;
    }
    if (this.run !== app.run) {
      this.run = app.run;
      this.rate = this.places = null;
      this.marks = [];
      clear(this.said);
      app.fetch("rate").then((rate) => {
        this.rate = rate;
        this.draw();
        return app.happened();
      }).then((marks) => {
        this.marks = marks;
        this.draw();
      }).catch((error) => clear(this.said, error.message));
    }
    this.draw();
  }

  // Of both ends null is the end of the run. On the timeline the view is then that of the window.
  // Returns whether there is such a window.
  choose(start, end) {
    if (start !== null && end !== null && end <= start) {
      clear(this.said, "the window ends before it begins");
      return false;
    }
    clear(this.said);
    go({ start, end, from: null, to: null });
    return true;
  }

  typed() {
    const ends = [this.from, this.to].map((
      input,
    ) => (input.value.trim() === "" ? null : momentOf(input.value)));
    if (ends.includes(undefined)) {
      clear(this.said, "a time is written as 3.25 or 400 ms");
      return;
    }
    this.choose(...ends);
  }

  // A page that is ready late must not replace what somebody types meanwhile.
  write(input, moment) {
    if (input !== document.activeElement) {
      input.value = moment === undefined ? "" : secondsText(moment);
    }
  }

  async skipWarmUp() {
    clear(this.said, "looking for a warm-up …");
    try {
      const [skipped] = (await this.app.fetch("warm_up")).skipped;
      if (skipped && !this.choose(skipped, this.app.window.end ?? null)) return;
      clear(
        this.said,
        skipped
          ? `the first ${duration(skipped)} are left out`
          : "no warm-up is seen: the longest latencies do not lie at the start",
      );
    } catch (error) {
      clear(this.said, error.message);
    }
  }

  draw() {
    const { canvas, rate, app } = this;
    const box = canvas.getBoundingClientRect();
    if (!rate || !box.width) return;
    const ratio = devicePixelRatio || 1;
    canvas.width = box.width * ratio;
    canvas.height = box.height * ratio;
    const context = canvas.getContext("2d");
    context.scale(ratio, ratio);
    context.fillStyle = color("panel");
    context.fillRect(0, 0, box.width, box.height);
    const whole = app.run.length + 1;
    const chosen = this.drag
      ? {
        start: Math.min(this.drag.from, this.drag.to),
        end: Math.max(this.drag.from, this.drag.to),
      }
      : app.extent;
    const most = usualMost(rate.count);
    for (let row = 0; row < rate.rows; row++) {
      const high = Math.max(Math.min(rate.count[row] / most, 1) * (box.height - 3), 1);
      const isInside = rate.start_at[row] + rate.length[row] > chosen.start &&
        rate.start_at[row] < chosen.end;
      context.fillStyle = color(isInside ? "timer" : "faint");
      context.fillRect(
        (rate.start_at[row] / whole) * box.width,
        box.height - high,
        Math.max((rate.length[row] / whole) * box.width, 1),
        high,
      );
    }
    for (const mark of this.marks) {
      context.fillStyle = color(mark.color);
      context.fillRect((mark.at / whole) * box.width - 1, 0, 2, 7);
    }
    if (chosen.start <= 0 && chosen.end >= whole) return;
    context.strokeStyle = color("focus");
    context.lineWidth = 2;
    const left = (chosen.start / whole) * box.width;
    context.strokeRect(
      left + 1,
      1,
      Math.max(((chosen.end - chosen.start) / whole) * box.width - 2, 1),
      box.height - 2,
    );
  }

  // Names of nodes, namespaces, topics and services, each with its kind.
  async known() {
    if (this.places) return this.places;
    const rows = await this.app.fetch("row");
    const places = new Map();
    const add = (kind, name, isInternal) => {
      if (name && (!isInternal || this.app.internal)) places.set(`${kind} ${name}`, { kind, name });
    };
    for (let row = 0; row < rows.rows; row++) {
      const node = rows.node[row];
      add("node", node, false);
      const parts = (node ?? "").split("/").slice(1, -1);
      for (let depth = 1; depth <= parts.length; depth++) {
        add("namespace", `/${parts.slice(0, depth).join("/")}/`, false);
      }
      if (["publisher", "subscription"].includes(rows.kind[row])) {
        add("topic", rows.label[row], rows.is_internal[row]);
      }
      if (["service", "client"].includes(rows.kind[row])) {
        add("service", rows.label[row], rows.is_internal[row]);
      }
    }
    this.places = [...places.values()];
    return this.places;
  }

  async find() {
    const text = this.search.value.trim().toLowerCase();
    if (!text) {
      this.found.hidden = true;
      return;
    }
    let places = [];
    try {
      places = await this.known();
    } catch (error) {
      clear(this.said, error.message);
    }
    const rank = ({ name }) => (name.toLowerCase().startsWith(text) ? 0 : 1);
    const hits = places.filter(({ name }) => name.toLowerCase().includes(text))
      .sort((a, b) =>
        rank(a) - rank(b) || a.name.length - b.name.length || a.name.localeCompare(b.name)
      );
    const links = hits.slice(0, MOST_FOUND).map(({ kind, name }) => {
      const [page, key] = FOUND_ON[kind];
      return this.link(kind, name, pageAddress(page, { [key]: name }));
    });
    const at = momentOf(text);
    if (at !== undefined) {
      const around = Math.max(Math.round(this.app.run.length / 200), 1000);
      links.unshift(
        this.link(
          "moment",
          `${secondsText(at)} s`,
          pageAddress("timeline", { from: Math.max(at - around, 0), to: at + around }),
        ),
      );
    }
    clear(
      this.found,
      links.length ? links : h("span", { className: "soft" }, "nothing has this in its name"),
    );
    this.found.hidden = false;
  }

  link(kind, name, href) {
    return h(
      "a",
      {
        href,
        on: {
          click: () => {
            this.found.hidden = true;
          },
        },
      },
      h("span", { className: "soft" }, `${kind} `),
      breakable(name),
    );
  }

  async keyDown(event) {
    if (event.key === "Escape") this.found.hidden = true;
    if (!["Enter", "ArrowDown"].includes(event.key)) return;
    event.preventDefault();
    // Who types fast presses the key before the names are read.
    await this.finding;
    const first = this.found.querySelector("a");
    if (this.found.hidden || !first) return;
    if (event.key === "Enter") first.click();
    else first.focus();
  }

  async copyLink() {
    try {
      await navigator.clipboard.writeText(location.href);
      this.copy.textContent = "copied";
    } catch {
      this.copy.textContent = "copy it from the address bar";
    }
    setTimeout(() => {
      this.copy.textContent = "copy link";
    }, 2000);
  }
}
