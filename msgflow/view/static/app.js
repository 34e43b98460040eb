// The application: it chooses where data come from, and shows the page of the address.

import { clear, color, h } from "./dom.js";
import { address, current, go, onChange, pageAddress, replace } from "./address.js";
import { embedded } from "./report_data.js";
import { decode, records } from "./table_decoding.js";
import { OverviewPage } from "./overview.js";
import { PathsPage } from "./paths.js";
import { TimelinePage } from "./timeline.js";
import { GraphPage } from "./graph.js";
import { NodesPage } from "./nodes.js";
import { TopicsPage } from "./topics.js";
import { Bar } from "./bar.js";
import { ComparePage } from "./compare.js";
import { WhatIfPage } from "./what_if.js";
import { SqlPage } from "./sql.js";
import { Follower } from "./follower.js";
import { failed, waiting } from "./notice.js";
import { Course } from "./course.js";
import { happened } from "./marks.js";

const PAGES = {
  overview: ["Overview", OverviewPage],
  paths: ["Paths", PathsPage],
  timeline: ["Timeline", TimelinePage],
  graph: ["Graph", GraphPage],
  nodes: ["Nodes", NodesPage],
  topics: ["Topics", TopicsPage],
  compare: ["Compare", ComparePage],
  what_if: ["What if", WhatIfPage],
  sql: ["SQL", SqlPage],
};
// Pages that are sections of others: where their addresses lead, and what their own words are there.
const MOVED = {
  timers: ({ callback }) => ({ page: "nodes", callback: null, timer: callback }),
  services: () => ({ page: "nodes" }),
  executors: () => ({ page: "nodes" }),
  losses: ({ topic }) => ({ page: "topics", topic: null, lost: topic }),
};
// What only a server answers.
const SERVED_PAGES = ["sql", "what_if"];

// What the server said in place of an answer.
class SourceError extends Error {
  constructor(message, hint, code) {
    super(message);
    this.hint = hint;
    this.code = code;
  }
}

// The answers of a server. It keeps the latest 60.
class ServedSource {
  constructor() {
    this.isServed = true;
    this.notes = [];
    this.kept = new Map();
    this.generation = document.documentElement.dataset.generation ?? "";
    this.token = keptToken();
  }

  async fetch(name, params = {}, signal = undefined) {
    const place = placeOf(name, params);
    if (this.kept.has(place)) return this.kept.get(place);
    const table = await this.ask(name, params, signal);
    this.kept.set(place, table);
    if (this.kept.size > 60) this.kept.delete(this.kept.keys().next().value);
    return table;
  }

  // Asks the server, whatever it has said before.
  async ask(name, params, signal) {
    return decode(new Uint8Array(await (await this.get(name, params, signal)).arrayBuffer()));
  }

  async get(name, params = {}, signal = undefined) {
    let answer;
    try {
      answer = await fetch(placeOf(name, params), {
        signal,
        headers: { "X-Generation": this.generation, "X-Token": this.token },
      });
    } catch (error) {
      if (error.name === "AbortError") throw error;
      throw new SourceError("the server does not answer", "is msgflow ui still running?", "gone");
    }
    if (!answer.ok) {
      const said = await answer.json().catch(() => ({}));
      throw new SourceError(said.error ?? answer.statusText, said.hint, said.code);
    }
    return answer;
  }

  // The database has moved on: from now on answers are of its new state.
  moveOn(generation) {
    this.generation = generation;
    this.kept.clear();
  }
}

// The token of the printed address, which leaves the address bar. What is kept is kept by port: other
// servers of this machine do not see it.
function keptToken() {
  const given = new URLSearchParams(location.search).get("token");
  if (given === null) return localStorage.getItem("msgflow-token") ?? "";
  localStorage.setItem("msgflow-token", given);
  history.replaceState(null, "", `${location.pathname}${location.hash}`);
  return given;
}

function placeOf(name, params) {
  const query = new URLSearchParams();
  for (const [key, value] of Object.entries(params)) {
    if (value !== null && value !== undefined) query.set(key, value);
  }
  return `api/${name}?${query}`;
}

class App {
  constructor(source) {
    this.source = source;
    this.steps = [];
    // The page that is shown, and the one that comes next.
    this.open = [];
  }

  async start() {
    const runs = await this.source.fetch("run");
    this.runs = records(runs);
    this.pages = Object.fromEntries(
      Object.entries(PAGES).filter((
        [page],
      ) => (this.source.pages
        ? this.source.pages.includes(page)
        : (this.source.isServed || !SERVED_PAGES.includes(page)) &&
          !this.source.absent?.includes(page))
      ),
    );
    if (!location.hash && this.source.address) history.replaceState(null, "", this.source.address);
    this.main = document.querySelector("main");
    this.nav = document.querySelector("nav");
    this.header();
    onChange(() => this.show());
    if ("follows" in document.documentElement.dataset) {
      this.follower = new Follower(this, document.querySelector(".bar"));
    }
    await this.show();
  }

  // Shows the same page of the state that the database has now; the old one stays until then.
  async moveOn(generation) {
    this.source.moveOn(generation);
    this.runs = records(await this.source.fetch("run"));
    this.runName.textContent = this.run?.name ?? "no run";
    await this.show(true);
  }

  get run() {
    const asked = current().run;
    return this.runs.find((run) => String(run.run_id) === asked) ?? this.runs[this.runs.length - 1];
  }

  fetch(name, params = {}, signal = undefined) {
    return this.source.fetch(name, { run: this.run.run_id, ...params }, signal);
  }

  // The window of time that holds on all pages, in nanoseconds since the begin of the run; without
  // the ends that nobody chose. A report has one of its own, which its data are of.
  get window() {
    if (!this.source.isServed) return {};
    const { start, end } = current();
    const ends = { start: whole(start), end: whole(end) };
    return Object.fromEntries(Object.entries(ends).filter(([, at]) => at !== null));
  }

  get internal() {
    return this.source.isServed && current().internal === "1";
  }

  // Where the window begins and ends on the time axis of a page.
  get extent() {
    const { start = 0, end = this.run.length + 1 } = this.window;
    return { start, end };
  }

  inWindow(name, params = {}, signal = undefined) {
    return this.fetch(name, { ...this.window, ...params }, signal);
  }

  query(name, params = {}) {
    return this.inWindow("query", { name, internal: this.internal ? 1 : null, ...params });
  }

  // When the run changed, and what happened in it: several parts of a page ask for them.
  async course() {
    return new Course(this, await this.inWindow("course"));
  }

  happened() {
    return happened(this);
  }

  header() {
    this.runName = h("span", { className: "run-name" }, this.run?.name ?? "no run");
    this.runChoice = this.runs.length > 1
      ? h(
        "select",
        {
          "aria-label": "run",
          on: {
            change: (event) => {
              location.hash = pageAddress(current().page, {
                run: event.target.value,
                start: null,
                end: null,
              });
            },
          },
        },
        this.runs.map((run) => h("option", { value: String(run.run_id) }, run.name)),
      )
      : this.runName;
    this.tabs = Object.entries(this.pages).map(([page, [title]]) => ({
      page,
      link: h("a", {}, title),
    }));
    const theme = h("button", {
      type: "button",
      className: "theme",
      title: "light or dark",
      "aria-label": "light or dark",
      on: { click: () => this.theme() },
    }, "◐");
    clear(
      this.nav,
      h("span", { className: "brand" }, "msgflow"),
      this.runChoice,
      h("span", { className: "tabs" }, this.tabs.map(({ link }) => link)),
      theme,
    );
    if (!this.source.pages) this.bar = new Bar(this, document.querySelector(".bar"));
    const said = document.querySelector(".said");
    if (this.source.notes.length) clear(said, this.source.notes.map((text) => h("p", {}, text)));
  }

  theme() {
    const root = document.documentElement;
    const isDark = root.dataset.theme
      ? root.dataset.theme === "dark"
      : matchMedia("(prefers-color-scheme: dark)").matches;
    root.dataset.theme = isDark ? "light" : "dark";
    this.page?.recolor?.();
  }

  linksMoved() {
    const { page } = current();
    this.bar?.update();
    if (this.runs.length > 1) this.runChoice.value = String(this.run.run_id);
    for (const { page: name, link } of this.tabs) {
      link.href = name === page ? address({}) : pageAddress(name);
      if (name === page) {
        link.setAttribute("aria-current", "page");
        // Not all tabs fit on a phone.
        link.scrollIntoView({ block: "nearest", inline: "nearest" });
      } else link.removeAttribute("aria-current");
    }
  }

  async show(isNext = false) {
    const { page: name } = current();
    if (Object.keys(MOVED).includes(name)) replace({ ...MOVED[name](current()), section: name });
    const [title, Page] = this.pages[current().page] ?? [];
    if (!Page) {
      go({ page: Object.keys(this.pages)[0] });
      return;
    }
    this.linksMoved();
    document.title = `${title} – ${this.run?.name ?? "msgflow"}`;
    if (!isNext) {
      this.leaveAllBut(null);
      clear(this.main, waiting());
    }
    if (!this.run) {
      const cure = this.follower
        ? "The first window comes when the nodes have sent something."
        : "The database holds no run yet: msgflow ingest TRACE";
      clear(this.main, h("section", {}, h("h2", {}, "No run"), h("p", {}, cure)));
      this.done();
      return;
    }
    if (!this.run.start_text) {
      clear(
        this.main,
        h(
          "section",
          {},
          h("h2", {}, "Empty run"),
          h("p", {}, `The run ${this.run.name} has no events. msgflow check says why.`),
        ),
      );
      this.done();
      return;
    }
    // A page has a place of its own: one that was left may still come to its end.
    const root = h("div", { className: isNext ? "next" : "" }, waiting());
    if (isNext) this.main.append(root);
    else clear(this.main, root);
    const page = new Page(this, root);
    this.page = page;
    this.open.push(page);
    try {
      await page.ready;
      if (isNext) await page.complete;
    } catch (error) {
      if (error.name !== "AbortError") clear(root, failed(error));
    }
    // Meanwhile somebody may have gone to another page.
    if (isNext && this.page === page) {
      this.leaveAllBut(page);
      root.className = "";
      this.main.replaceChildren(root);
    }
    this.done();
  }

  leaveAllBut(page) {
    for (const each of this.open) if (each !== page) each.leave?.();
    this.open = this.open.filter((each) => each === page);
  }

  // For tests and benchmarks: when the page stands, and how long each drawing took [ms].
  done() {
    document.documentElement.dataset.ready = String(
      Number(document.documentElement.dataset.ready ?? 0) + 1,
    );
  }

  drawn(milliseconds) {
    this.steps.push(milliseconds);
    if (this.steps.length === 1) {
      document.documentElement.dataset.painted = String(performance.now());
    }
  }
}

function whole(text) {
  return text && /^\d{1,18}$/.test(text) ? Number(text) : null;
}

const LACKING = [
  ["DecompressionStream", () => "DecompressionStream" in window],
  ["ResizeObserver", () => "ResizeObserver" in window],
  ["canvas", () => Boolean(document.createElement("canvas").getContext?.("2d"))],
];

async function start() {
  const lacking = LACKING.filter(([, has]) => !has()).map(([name]) => name);
  const main = document.querySelector("main");
  if (lacking.length) {
    clear(
      main,
      failed(
        new Error(
          `this browser lacks ${
            lacking.join(", ")
          }: a newer one is needed (Firefox 113, Chrome 80, Safari 16.4)`,
        ),
      ),
    );
    return;
  }
  try {
    const source = (await embedded()) ?? new ServedSource();
    const app = new App(source);
    window.msgflow = app;
    await app.start();
  } catch (error) {
    clear(main, failed(error));
    throw error;
  }
}

start();
