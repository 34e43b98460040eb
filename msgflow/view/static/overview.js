// The first page: what was recorded, what is wrong with it, and what is slow.

import { breakable, clear, h } from "./dom.js";
import { address } from "./address.js";
import { count, duration, PATH_HELP, pathText, wallClock } from "./labels.js";
import { command, doubt, doubtHelp, failed, notes, waiting } from "./notice.js";
import { blame, summary, verdict, withoutRepeated } from "./summary.js";
import { courseSummary } from "./course.js";

export class OverviewPage {
  constructor(app, root) {
    this.app = app;
    this.root = root;
    this.ready = this.build();
  }

  async build() {
    const { app, root } = this;
    const { run } = app;
    const facts = h("dl", { className: "facts" });
    const fact = (name, value) => facts.append(h("div", {}, h("dt", {}, name), h("dd", {}, value)));
    fact("recorded", wallClock(run.start_text, 0).replace("T", " ").replace(/\.\d+Z$/, " UTC"));
    fact("length", duration(run.length));
    fact("events", (run.event_count ?? 0).toLocaleString("en-US"));
    // Requirements and changes: a report has them where it was given a file, or another run.
    const given = (app.source.summary ?? []).filter((part) =>
      part === "verdicts" || part === "change"
    )
      .map((part) => ({ part, ...section(part === "verdicts" ? "Requirements" : "What changed") }));
    const why = section("What makes data late, or lets them get lost");
    const changed = section("When it changed");
    const wrong = section("What is wrong with the recording");
    const slow = section("The slowest paths");
    const nodes = section("Where the time of the slowest flows went");
    const drops = section("What was dropped or lost, and why");
    const threads = section("Busiest threads");
    clear(
      root,
      [why, ...given, changed, wrong].map((one) => one.root),
      h("section", {}, h("h2", {}, "What was recorded"), facts),
      [slow, nodes, drops, threads].map((one) => one.root),
    );
    const hosts = app.query("info-hosts").then((table) => {
      const list = Array.from({ length: table.rows }, (_, row) => table.hostname[row]);
      fact(list.length === 1 ? "host" : "hosts", list.join(", "));
    }).catch((error) => facts.after(failed(error)));
    const findings = fill(wrong, async () => {
      const table = await app.fetch("finding");
      const kinds = new Map();
      table.name.forEach((name, row) => kinds.set(name, [...(kinds.get(name) ?? []), row]));
      const list = [...kinds.values()].map((rows) => {
        const first = rows[0];
        const more = rows.length > 1 ? ` and ${rows.length - 1} more` : "";
        return h(
          "details",
          { className: `finding ${table.severity[first]}` },
          h(
            "summary",
            {},
            h("span", { className: "severity" }, table.severity[first]),
            ` ${table.title[first]} `,
            h("span", { className: "soft" }, `${table.subject[first]}${more}`),
          ),
          h(
            "ul",
            {},
            rows.slice(0, 5).map((row) =>
              h("li", {}, h("b", {}, table.subject[row]), `: ${table.detail[row]}`)
            ),
            rows.length > 5 && h("li", {}, `… and ${rows.length - 5} more`),
          ),
          h("p", {}, table.description[first]),
          h("p", {}, h("b", {}, "Cause: "), table.cause[first]),
          h("p", {}, h("b", {}, "Cure: "), table.cure[first]),
        );
      });
      return [
        list.length ? list : h("p", {}, "Nothing is wrong with the recording."),
        notes(table.meta.notes),
        command(table.meta.command),
      ];
    });
    const paths = fill(slow, async () => {
      const table = await app.query("e2e-latency");
      const order = Array.from({ length: table.rows }, (_, row) => row).filter((row) =>
        !Number.isNaN(table.max_ns[row])
      )
        .sort((a, b) => table.max_ns[b] - table.max_ns[a]);
      const most = order.length ? Math.max(...order.map((row) => table.p99_ns[row])) : 1;
      if (!order.length) {
        return [
          h(
            "p",
            {},
            table.rows
              ? "No flow reached the end of a path."
              : "There are no paths: no message is known to have been taken.",
          ),
          notes(table.meta.notes),
        ];
      }
      const known = await app.fetch("path");
      const ids = pathNumbers(table, known);
      const isDoubted = doubted(table, known, ids);
      let before = "";
      const textOf = (row) => {
        const path = pathText(table.path[row]);
        const text = withoutRepeated(path, before);
        before = path;
        return h("span", { className: "path-text", title: path }, breakable(text));
      };
      return [
        h(
          "p",
          { className: "soft" },
          `A path is a chain of nodes and topics that messages took. ${PATH_HELP} A click shows more.`,
        ),
        h(
          "div",
          { className: "legend" },
          [["bar-median", "median: half of its flows took no longer"], [
            "bar-p99",
            "p99: 99 % of them took no longer",
          ]].map(([shade, text]) =>
            h(
              "span",
              { className: "legend-item" },
              h("span", { className: `swatch ${shade}` }),
              text,
            )
          ),
        ),
        h(
          "ol",
          { className: "slow" },
          order.slice(0, 10).map((row) =>
            h(
              "li",
              {},
              h(
                "a",
                { href: address({ page: "paths", path: ids[row] }) },
                h(
                  "span",
                  { className: "bar-track" },
                  bar(table.median_ns[row] / most, "bar-median"),
                  bar(table.p99_ns[row] / most, "bar-p99"),
                ),
                h(
                  "span",
                  { className: "numbers" },
                  `${duration(table.median_ns[row])} median · ${duration(table.p99_ns[row])} p99`,
                  isDoubted(row) && doubt(),
                ),
                textOf(row),
              ),
            )
          ),
        ),
        order.slice(0, 10).some(isDoubted) && doubtHelp(),
        order.length > 10 &&
        h(
          "p",
          {},
          h("a", { href: address({ page: "paths" }) }, `all ${count(order.length, "path")}`),
        ),
        notes(table.meta.notes),
        command(table.meta.command),
      ];
    });
    const requirements = given.map((one) =>
      fill(one, async () => summary(await app.fetch("summary", { part: one.part })))
    );
    const verdicts = fill(why, async () => verdict(await app.inWindow("summary", { part: "why" })));
    const above = Promise.all([hosts, findings, paths, ...requirements]);
    // The page stands without what takes longest. A server is asked for what stands further below
    // when somebody looks there: once all above has its height. A page that follows is whole.
    const isWhole = !app.source.isServed || app.follower;
    const courses = fill(changed, async () => {
      // The verdict has found the changes, too.
      if (!isWhole) await Promise.all([above, verdicts]);
      return courseSummary(await app.course(), await app.happened());
    });
    const below = [[nodes, "blame", blame], [drops, "drops", summary], [
      threads,
      "threads",
      summary,
    ]].map(([place, part, show]) =>
      fill(place, async () => {
        if (!isWhole) await Promise.all([above, verdicts]).then(() => seen(place.root));
        return show(await app.inWindow("summary", { part }));
      })
    );
    this.complete = Promise.all([verdicts, courses, ...below]);
    await (isWhole ? Promise.all([above, this.complete]) : above);
  }

  leave() {}
}

function bar(share, name) {
  const element = h("span", { className: name });
  element.style.width = `${Math.max(100 * share, 0.3)}%`;
  return element;
}

function section(title) {
  const body = h("div", {}, waiting());
  return { root: h("section", {}, h("h2", {}, title), body), body };
}

// Resolves when an element is on the screen.
function seen(element) {
  return new Promise((resolve) => {
    const observer = new IntersectionObserver((entries) => {
      if (!entries.some((entry) => entry.isIntersecting)) return;
      observer.disconnect();
      resolve();
    });
    observer.observe(element);
  });
}

async function fill(place, make) {
  try {
    clear(place.body, await make());
  } catch (error) {
    if (error.name !== "AbortError") clear(place.body, failed(error));
  }
}

// Whether the hosts of a path, a row of `table`, have clocks that are not synchronised.
export function doubted(table, paths, ids) {
  const apart = new Set(
    Array.from(paths.path_id).filter((_, row) => paths.is_comparable[row] === false),
  );
  return (row) => apart.has(ids[row]);
}

// Which path of `paths` each row of a query is about.
export function pathNumbers(table, paths) {
  const known = new Map(Array.from(paths.path, (path, row) => [path, paths.path_id[row]]));
  return Array.from(table.path, (path) => known.get(path));
}
