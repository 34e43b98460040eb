// SQL: any query that only reads, its rows as a table or a chart, and where they are on the timeline.

import { clear, h } from "./dom.js";
import { current, pageAddress, replace } from "./address.js";
import { count, duration, KIND_NAMES, shellQuoted } from "./labels.js";
import { dataTable } from "./table.js";
import { redrawCharts } from "./chart.js";
import { csvText, saveFile } from "./download.js";
import { failed, waiting } from "./notice.js";
import { sqlEditor } from "./editor.js";
import { drawingOf, DRAWINGS, Figures } from "./figures.js";
import { queryFile } from "./query_file.js";

const FIRST_QUERY = "SELECT *\nFROM callback_label\nORDER BY node, label";
const ROW_LIMITS = [1_000, 10_000, 100_000];
// The address of a question has the query: servers take 64 kB of head at the most.
const MOST_OF_ADDRESS = 50_000;
// What was typed is there again when the page is.
let typed = null;

export class SqlPage {
  constructor(app, root) {
    this.app = app;
    this.root = root;
    this.ready = this.build();
  }

  async build() {
    const { app } = this;
    const asked = current();
    const [library, words, examples] = await Promise.all([
      import("./codemirror.min.js"),
      app.source.fetch("word"),
      app.source.fetch("example"),
    ]);
    this.words = words;
    typed = asked.text ?? typed ?? FIRST_QUERY;
    this.editor = sqlEditor(library, words, {
      text: typed,
      run: () => this.run(),
      changed: () => {
        typed = this.editor.text();
      },
    });
    const button = (text, action, more) =>
      h("button", { type: "button", on: { click: action }, ...more }, text);
    this.runButton = button("Run", () => this.run(), { className: "run", title: "Ctrl and Enter" });
    this.stopButton = button("Stop", () => this.leave(), { hidden: true });
    const example = h(
      "select",
      {
        "aria-label": "examples",
        on: {
          change: () => {
            const sql = examples.sql[example.selectedIndex - 1];
            example.selectedIndex = 0;
            this.editor.set(sql);
            this.run();
          },
        },
      },
      h("option", {}, "examples …"),
      Array.from(examples.title, (title) => h("option", {}, title)),
    );
    this.rows = h(
      "select",
      { "aria-label": "most rows" },
      ROW_LIMITS.map((number) =>
        h(
          "option",
          { value: String(number), selected: asked.rows === String(number) },
          count(number, "row"),
        )
      ),
    );
    this.result = h("div", { className: "sql-result" });
    clear(
      this.root,
      h(
        "section",
        {},
        h("h2", {}, "SQL"),
        h(
          "p",
          { className: "soft" },
          "One query on the public views. It can change nothing and reach no other file. Ctrl and Enter runs it; Ctrl and Space completes names.",
        ),
        h(
          "div",
          { className: "stage" },
          h(
            "div",
            { className: "written" },
            this.editor.root,
            h(
              "div",
              { className: "tools sql-tools" },
              this.runButton,
              button("EXPLAIN", () => this.run("EXPLAIN ")),
              this.stopButton,
              example,
              h("label", {}, "at most ", this.rows),
              button("Save as named query", () => this.save()),
            ),
          ),
          this.names(),
        ),
      ),
      this.result,
    );
    // Who has opened a link sees its rows. Only this page's own links come here: others have no cookie.
    if (asked.text !== undefined) await this.run();
  }

  // The views with their columns; a click writes a name into the text.
  names() {
    const { words } = this;
    const of = (kind) => [...words.kind.keys()].filter((row) => words.kind[row] === kind);
    const columns = of("column");
    const views = of("view").map((row) => [
      row,
      ...columns.filter((column) => words.view[column] === words.name[row]),
    ]);
    const button = (row) =>
      h("button", {
        type: "button",
        className: "pick",
        title: words.description[row] ?? "",
        on: {
          click: (event) => {
            event.preventDefault();
            this.editor.insert(words.name[row]);
          },
        },
      }, words.name[row]);
    const list = h("div", { className: "names-list" });
    const show = (text) =>
      clear(
        list,
        views.filter((rows) => rows.some((row) => words.name[row].includes(text)))
          .map(([view, ...own]) =>
            h(
              "details",
              {},
              h("summary", {}, button(view)),
              h(
                "ul",
                {},
                own.map((row) =>
                  h(
                    "li",
                    {},
                    button(row),
                    h("span", { className: "soft" }, ` ${words.detail[row]}`),
                  )
                ),
              ),
            )
          ),
      );
    show("");
    const field = h("input", {
      type: "search",
      placeholder: "view, column …",
      "aria-label": "show views with this text",
      on: { input: () => show(field.value.trim().toLowerCase()) },
    });
    return h("aside", { className: "side names", "aria-label": "views and columns" }, field, list);
  }

  // Asks the server; what is wrong with the query is shown and marked. Returns the rows, or null.
  async ask(text) {
    if (!text.trim()) return this.said("There is no SQL to run.");
    if (encodeURIComponent(text).length > MOST_OF_ADDRESS) {
      return this.said("This query is too long for the page.", "msgflow sql -f FILE");
    }
    this.leave();
    const asking = this.asking = new AbortController();
    this.stopButton.hidden = false;
    clear(this.result, waiting("asking …"));
    try {
      const table = await this.app.source.ask(
        "sql",
        { text, rows: this.rows.value },
        asking.signal,
      );
      this.editor.mark(null);
      if (table.meta.error === undefined) return rowsOf(table, this.app);
      const line = /^LINE (\d+): /m.exec(table.meta.error);
      this.editor.mark(line ? Number(line[1]) : null);
      return this.said(table.meta.error, table.meta.hint);
    } catch (error) {
      if (error.name === "AbortError") {
        if (asking === this.asking) {
          clear(this.result, h("p", { className: "soft", role: "status" }, "stopped"));
        }
      } else clear(this.result, failed(error));
      return null;
    } finally {
      if (asking === this.asking) this.stopButton.hidden = true;
    }
  }

  said(message, hint) {
    clear(
      this.result,
      h(
        "div",
        { className: "failed", role: "alert" },
        h("pre", {}, message),
        hint && h("p", { className: "soft" }, hint),
      ),
    );
    return null;
  }

  async run(before = "") {
    const text = this.editor.text();
    replace({ text, rows: this.rows.value === String(ROW_LIMITS[0]) ? null : this.rows.value });
    this.app.linksMoved();
    const begin = performance.now();
    // EXPLAIN stands on the line of the query, so that lines are counted alike.
    const rows = await this.ask(/^\s*EXPLAIN\b/i.test(text) ? text : before + text);
    if (rows) this.show(rows, performance.now() - begin, text);
  }

  show(rows, milliseconds, text) {
    const plan = rows.columns.find((column) => column.label === "explain_value");
    const said = h(
      "p",
      { className: "soft", role: "status" },
      `${count(rows.rows, "row")} in ${duration(milliseconds * 1e6)}`,
    );
    if (plan) {
      clear(
        this.result,
        h(
          "section",
          {},
          said,
          h("pre", { className: "plan", tabIndex: 0 }, rows[plan.name].join("\n")),
        ),
      );
      return;
    }
    const leads = leadsOf(rows);
    const table = dataTable(rows, {
      label: "rows",
      columns: rows.columns.map((column) => column.name),
      nothing: "no rows",
      onPick: leads && ((row) => this.lead(rows, leads, row)),
    });
    const figures = new Figures(rows);
    const body = h("div");
    const draw = (drawing) => {
      replace({ draw: drawing === DRAWINGS[0] ? null : drawing });
      for (const one of choices.children) {
        one.setAttribute("aria-pressed", String(one.textContent === drawing));
      }
      clear(body, drawing === DRAWINGS[0] ? table : figures.drawn(drawing));
    };
    const choices = h(
      "div",
      { className: "group", role: "group", "aria-label": "shown as" },
      DRAWINGS.map((drawing) =>
        h("button", { type: "button", on: { click: () => draw(drawing) } }, drawing)
      ),
    );
    const csv = h("button", {
      type: "button",
      title: "download as CSV",
      on: {
        click: () =>
          saveFile(
            new Blob([csvText(rows.columns.map((column) => [column.label, column.exact]))], {
              type: "text/csv",
            }),
            "rows.csv",
          ),
      },
    }, "CSV");
    clear(
      this.result,
      h(
        "section",
        {},
        said,
        rows.meta.is_cut &&
          h(
            "p",
            { className: "notes" },
            `Only the first ${
              count(rows.rows, "row")
            }: there are more, which tables and charts leave out.`,
          ),
        h("div", { className: "tools" }, choices, csv),
        leads && h("p", { className: "soft" }, "A click on a row leads to it on the timeline."),
        body,
        h(
          "p",
          { className: "command" },
          "the same rows: ",
          h("code", {}, `msgflow sql ${shellQuoted(text)}`),
        ),
      ),
    );
    draw(drawingOf(current().draw));
  }

  // To the timeline: the flow of what the row names, else the moment that it names.
  async lead(rows, leads, row) {
    const { app } = this;
    const [kind, id] = leads.thing(row) ?? [];
    const time = leads.time && !Number.isNaN(rows[leads.time.name][row]) ? leads.time : null;
    if (kind === undefined && !time) return;
    let run = time?.run ?? app.run;
    if (kind !== undefined && app.runs.length > 1) {
      const found = await app.fetch("place", { kind, id });
      run = app.runs.find(({ run_id }) => run_id === found.run_id[0]) ?? run;
    }
    const other = run === app.run ? {} : { start: null, end: null };
    if (kind !== undefined) {
      location.hash = pageAddress("timeline", { run: run.run_id, ...other, flow: `${kind}:${id}` });
      return;
    }
    const around = Math.max(Math.round(run.length / 200), 1000);
    const at = rows[time.name][row];
    location.hash = pageAddress("timeline", {
      run: run.run_id,
      ...other,
      from: Math.max(at - around, 0),
      to: at + around,
    });
  }

  async save() {
    const name = h("input", {
      type: "text",
      value: "my-query",
      pattern: "[a-z][a-z0-9]*(-[a-z0-9]+)*",
      "aria-label": "name of the query",
    });
    const title = h("input", {
      type: "text",
      value: "What it answers",
      "aria-label": "title of the query",
    });
    const text = this.editor.text();
    const described = await this.ask(`DESCRIBE ${text}`);
    if (!described) return;
    const shown = h("pre", { className: "plan query-file", tabIndex: 0 });
    const file = () => queryFile(text, { title: title.value }, described, this.words);
    const fill = () => clear(shown, file());
    title.addEventListener("input", fill);
    fill();
    clear(
      this.result,
      h(
        "section",
        {},
        h("h3", {}, "A named query"),
        h(
          "div",
          { className: "tools" },
          h("label", {}, "name ", name),
          h("label", {}, "title ", title),
          h("button", {
            type: "button",
            on: {
              click: () => {
                if (name.reportValidity()) {
                  saveFile(new Blob([file()], { type: "application/sql" }), `${name.value}.sql`);
                }
              },
            },
          }, "Download"),
        ),
        h(
          "p",
          { className: "soft" },
          "msgflow sql -f FILE runs it. In the folder queries/ of a checkout of msgflow it is a command; CONTRIBUTING.md says what else a query there needs.",
        ),
        shown,
      ),
    );
  }

  recolor() {
    redrawCharts();
  }
  leave() {
    this.asking?.abort();
  }
}

// Rows as the page shows them: columns have labels, numbers of a run's time count from its begin, and
// every value stays as it was in `exact`.
function rowsOf(table, app) {
  const { names, integers } = table.meta;
  const rows = { rows: table.rows, meta: { is_cut: table.meta.is_cut }, columns: [] };
  table.columns.forEach((column, at) => {
    const exact = Array.from(
      table[column.name],
      (
        value,
      ) => (typeof value === "number" && Number.isNaN(value) && column.type === "integer"
        ? null
        : value),
    );
    const run = integers[at] && column.type === "text" ? runOf(exact, app) : null;
    rows[column.name] = run
      ? exact.map((
        value,
      ) => (value === null ? NaN : Number(BigInt(value) - BigInt(run.start_text))))
      : table[column.name];
    rows.columns.push({
      name: column.name,
      label: names[at],
      type: run ? "integer" : column.type,
      run,
      exact,
      shown: (row) => exactText(exact[row]),
    });
  });
  return rows;
}

function exactText(value) {
  return value === null || value === undefined ? "" : String(value);
}

// The run that all times of a column lie in, if they are times: its own one, else the first such.
function runOf(values, app) {
  const known = values.filter((value) => value !== null).map(BigInt);
  if (!known.length) return null;
  const isInside = ({ start_text: start, length }) =>
    start &&
    known.every((value) => value >= BigInt(start) && value <= BigInt(start) + BigInt(length));
  return [app.run, ...app.runs].find(isInside) ?? null;
}

// How rows name things: by an identity of a kind, by kind and identity, or by the root of a flow.
function leadsOf(rows) {
  const column = (label) => rows.columns.find((one) => one.label === label);
  const value = (one, row) => one?.exact[row] ?? undefined;
  const pairs = [["root_kind", "root_id"], ["kind", "id"]].map((pair) => pair.map(column)).filter((
    [kind, id],
  ) => kind && id);
  const single = KIND_NAMES.map((kind) => [kind, column(`${kind}_id`)]).filter(([, id]) => id);
  const time = rows.columns.find((one) => one.run);
  if (!pairs.length && !single.length && !time) return null;
  const thing = (row) =>
    [
      ...pairs.map(([kind, id]) => [value(kind, row), value(id, row)]),
      ...single.map(([kind, id]) => [kind, value(id, row)]),
    ]
      .find(([kind, id]) => KIND_NAMES.includes(kind) && Number.isInteger(id));
  return { thing, time };
}
