// A table beside every chart: sorted by a click, with what its columns mean.

import { breakable, clear, h } from "./dom.js";
import { cell, count, title } from "./labels.js";
import { doubt } from "./notice.js";

const SHOWN = 100;
const HIDDEN = new Set(["run_id"]);

// Those of some columns that have a value in any row.
export function filled(table, names) {
  return names.filter((name) =>
    Array.from(table[name] ?? []).some((value) =>
      value !== null && value !== undefined && !Number.isNaN(value)
    )
  );
}

// A column of the table may have a label in place of its name, and shown(row): the text of a cell.
// Options: columns (names, in order), onPick(row), picked (row), sort, label, shown, order (compares
// two rows before any column is chosen), once (a column that is left empty below an equal value),
// doubted (row): its durations are between clocks that are not synchronised, state (an object that
// keeps the chosen order while the table is made anew).
export function dataTable(table, options = {}) {
  const described = table.meta?.columns ?? {};
  const names = options.columns ?? table.columns.map((column) => column.name)
    .filter((name) => !HIDDEN.has(name));
  const columns = names.map((name) => table.columns.find((column) => column.name === name))
    .filter(Boolean);
  const order = Array.from({ length: table.rows }, (_, row) => row)
    .filter((row) => !options.only || options.only(row));
  if (options.order) order.sort(options.order);
  const state = options.state ?? {};
  let sort = state.sort ?? options.sort ?? null;
  let shown = options.shown ?? SHOWN;
  const body = h("tbody");
  const more = h("button", {
    type: "button",
    className: "more",
    on: {
      click: () => {
        shown *= 10;
        fill();
      },
    },
  });
  const heads = columns.map((column) => {
    const isNumber = column.type === "integer" || column.type === "double";
    return h(
      "th",
      { scope: "col", className: isNumber ? "number" : "", title: described[column.name] ?? "" },
      h("button", {
        type: "button",
        on: {
          click: () => {
            sort = state.sort = {
              name: column.name,
              down: sort?.name === column.name ? !sort.down : isNumber,
            };
            fill();
          },
        },
      }, column.label ?? title(column.name)),
    );
  });

  function fill() {
    if (sort && table[sort.name]) {
      const values = table[sort.name];
      order.sort((a, b) => {
        const [x, y] = [values[a], values[b]];
        const missing = [x, y].map((v) => v === null || v === undefined || Number.isNaN(v));
        if (missing[0] || missing[1]) return missing[0] - missing[1] || a - b;
        const difference = typeof x === "number" ? x - y : String(x).localeCompare(String(y));
        return (sort.down ? -difference : difference) || a - b;
      });
    }
    heads.forEach((head, position) => {
      const is = sort?.name === columns[position].name;
      head.setAttribute("aria-sort", is ? (sort.down ? "descending" : "ascending") : "none");
    });
    clear(
      body,
      order.slice(0, shown).map((row, place) => {
        const cells = columns.map((column, position) => {
          const isNumber = column.type === "integer" || column.type === "double";
          const isAgain = column.name === options.once && place &&
            table[column.name][row] === table[column.name][order[place - 1]];
          const text = isAgain
            ? ""
            : column.shown
            ? column.shown(row)
            : cell(table[column.name][row], column);
          const inside = position === 0 && options.onPick && !isAgain
            ? h(
              "button",
              { type: "button", className: "pick" },
              text ? (isNumber ? text : breakable(text)) : "–",
            )
            : isNumber
            ? text
            : breakable(text);
          // On a phone a row is a card, where every value says what it is.
          const shape = isNumber
            ? "number"
            : `text${String(text).length > 60 ? " long" : String(text).length > 18 ? " name" : ""}`;
          return h(
            "td",
            {
              data: { title: column.label ?? title(column.name) },
              className: text === "" ? `${shape} empty` : shape,
            },
            inside,
            text !== "" && column.unit === "ns" && options.doubted?.(row) && doubt(),
          );
        });
        return h("tr", {
          className: options.onPick ? "can-pick" : "",
          "aria-selected": options.picked?.(row) ? "true" : undefined,
          data: options.data?.(row),
          on: options.onPick ? { click: () => options.onPick(row) } : {},
        }, cells);
      }),
    );
    more.hidden = order.length <= shown;
    more.textContent = `show more: ${
      count(order.length - Math.min(shown, order.length), "row")
    } not shown`;
  }

  fill();
  return h(
    "div",
    { className: "table-frame" },
    scrolls(options.label ?? "table", h("table", {}, h("thead", {}, h("tr", {}, heads)), body)),
    order.length === 0 && h("p", { className: "nothing" }, options.nothing ?? "nothing"),
    more,
  );
}

// What is wider than its place scrolls, and its right edge says that there is more.
export function scrolls(label, ...content) {
  const inside = h("div", {
    className: "table-scroll",
    tabIndex: 0,
    role: "region",
    "aria-label": label,
  }, content);
  const frame = h("div", { className: "table-edge" }, inside);
  const look = () =>
    frame.classList.toggle(
      "has-more",
      inside.scrollLeft + inside.clientWidth < inside.scrollWidth - 2,
    );
  inside.addEventListener("scroll", look);
  new ResizeObserver(look).observe(inside);
  return frame;
}

export function besides(label, ...content) {
  return h("details", { className: "beside" }, h("summary", {}, label), content);
}
