// When a run changed: lines over time with their changes, and what happened meanwhile.

import { h, svg } from "./dom.js";
import { momentAxis, pathText } from "./labels.js";
import { aroundMoment, markWords } from "./marks.js";
import { chart } from "./chart.js";
import { dataTable } from "./table.js";
import { command, notes } from "./notice.js";

export const OF_CALLBACK = ["duration", "CPU time", "timer"];
export const OF_TOPIC = ["wait", "queue", "topic", "loss"];
const OF_CHANGES = [
  "at_ns",
  "kind",
  "what",
  "node",
  "subject",
  "change",
  "count",
  "since",
  "follows",
];
// Of values that are no durations.
const PLAIN_UNITS = { queue: "messages", "CPU use": "CPUs" };
const [SPARK_WIDTH, SPARK_HEIGHT] = [120, 22];

// The changes of the window, with the lines in which they were looked for. A file may not hold them.
export class Course {
  constructor(app, changes) {
    this.app = app;
    this.changes = changes;
    this.lines = new Map(
      changes.meta.lines.map((line) => [lineKey(line.what, line.node, line.subject), line]),
    );
  }

  // Rows of changes for which all of `is` holds: a function of a row.
  rows(is) {
    return Array.from({ length: this.changes.rows }, (_, row) => row).filter(is);
  }

  // Of a callback, topic or path: the changes of these kinds, without a node those of all nodes.
  of(whats, subject, node = undefined) {
    const { what, subject: subjects, node: nodes } = this.changes;
    return this.rows((row) =>
      whats.includes(what[row]) && subjects[row] === subject &&
      (node === undefined || nodes[row] === node)
    );
  }

  marks(rows) {
    const { at_ns: at, kind, what, change } = this.changes;
    return rows.map((row) => ({
      at: at[row],
      color: "critical",
      isChange: true,
      text: markWords(at[row], [`${kind[row]}, ${what[row]} ${change[row]}`], 1),
    }));
  }

  line(whats, subject, node = undefined) {
    for (const what of whats) {
      if (node !== undefined) {
        const found = this.lines.get(lineKey(what, node, subject));
        if (found) return found;
      } else {
        for (const line of this.lines.values()) {
          if (line.what === what && line.subject === subject) return line;
        }
      }
    }
    return null;
  }

  // A column of a table: the line of each row as a small picture, sorted by how much it changed.
  // `find` returns what `line` and `of` need for a row: [whats, subject, node].
  column(table, find) {
    table.course = Array.from({ length: table.rows }, (_, row) => {
      const { before, after } = this.changes;
      const sizes = this.of(...find(row)).map((each) =>
        Math.abs(Math.log((after[each] || 1e-3) / (before[each] || 1e-3)))
      );
      return sizes.length ? Math.max(...sizes) : NaN;
    });
    table.columns = [
      ...table.columns.filter(({ name }) => name !== "course"),
      {
        name: "course",
        label: "over time",
        type: "double",
        shown: (row) => {
          const line = this.line(...find(row));
          return line ? this.spark(line, this.of(...find(row))) : "";
        },
      },
    ];
  }

  spark(line, rows) {
    const { start, end } = this.app.extent;
    const most = Math.max(...line.value, 1e-9);
    const x = (at) => ((at - start) / (end - start || 1)) * SPARK_WIDTH;
    const points = line.times.map((at, place) =>
      `${x(at).toFixed(1)},${
        (SPARK_HEIGHT - 1 - (line.value[place] / most) * (SPARK_HEIGHT - 3)).toFixed(1)
      }`
    );
    const texts = this.marks(rows);
    return svg(
      "svg",
      {
        class: "spark",
        width: SPARK_WIDTH,
        height: SPARK_HEIGHT,
        viewBox: `0 0 ${SPARK_WIDTH} ${SPARK_HEIGHT}`,
        role: "img",
        "aria-label": texts.length ? texts.map(({ text }) => text).join("; ") : "no change",
      },
      texts.map(({ at, text }) =>
        svg("line", { x1: x(at), x2: x(at), y1: 0, y2: SPARK_HEIGHT, class: "spark-change" }, [
          svg("title", {}, text),
        ])
      ),
      svg("polyline", { points: points.join(" "), class: "spark-line" }),
    );
  }

  // A line as a large picture, with its changes and what happened; a click leads to the timeline.
  picture(line, rows, marks) {
    return chart(line.times, [{
      label: line.what,
      color: "timer",
      values: line.value,
    }], {
      title: `${line.what} over time`,
      height: 180,
      xFormat: momentAxis,
      xName: "begin [ns since begin of run]",
      ...(line.what in PLAIN_UNITS
        ? { yFormat: (value) => `${+value.toFixed(2)} ${PLAIN_UNITS[line.what]}` }
        : {}),
      marks: [...marks, ...this.marks(rows)],
      onClick: (place) => {
        location.hash = aroundMoment(this.app, line.times[place]);
      },
    });
  }

  // Changes as a table; a click leads to the timeline. Without one nothing.
  table(rows, title = "What changed") {
    if (!rows.length) return null;
    const shown = new Set(rows);
    return h(
      "section",
      {},
      h("h3", {}, title),
      h("p", { className: "soft" }, "A click shows that moment on the timeline."),
      dataTable(this.changes, {
        label: title.toLowerCase(),
        columns: OF_CHANGES.filter((name) =>
          rows.some((row) =>
            ![null, undefined].includes(this.changes[name][row]) &&
            !Number.isNaN(this.changes[name][row])
          )
        ),
        only: (row) => shown.has(row),
        onPick: (row) => {
          location.hash = aroundMoment(this.app, this.changes.at_ns[row]);
        },
      }),
      notes(this.changes.meta.notes),
      command(this.changes.meta.command),
    );
  }
}

// A column with the line of each row, once it is known; `show` shows the table then. Without an
// answer there is none: what else asks for the course says why.
export async function courseColumn(app, table, find, show) {
  const course = await app.course().catch(() => null);
  if (!course) return;
  course.column(table, find);
  show();
}

function lineKey(what, node, subject) {
  return `${what}\n${node ?? ""}\n${subject}`;
}

// The first page: what changed in words, and the picture of the first change.
export function courseSummary(course, marks) {
  const { sentences } = course.changes.meta;
  if (!sentences.length) return [h("p", {}, "Nothing changed, as far as the values tell.")];
  const [first] = sentences;
  const rows = course.of([first.what], first.subject, first.node);
  const line = course.line([first.what], first.subject, first.node);
  return [
    sentences.slice(0, 3).map(({ sentence, at }) =>
      h("p", {}, h("a", { href: aroundMoment(course.app, at) }, pathText(sentence)))
    ),
    line && course.picture(line, rows, marks),
    sentences.length > 3 &&
    h(
      "details",
      {},
      h("summary", {}, `${sentences.length - 3} more`),
      course.table(course.rows(() => true)),
    ),
    command(course.changes.meta.command),
  ];
}
