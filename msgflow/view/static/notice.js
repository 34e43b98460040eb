// Notices: what pages say when something is under way, missing or wrong.

import { h } from "./dom.js";

export function waiting(text = "reading …") {
  return h("p", { className: "waiting", role: "status" }, text);
}

export function failed(error) {
  const reload = ["replaced", "gone", "unopened"].includes(error.code);
  return h(
    "div",
    { className: "failed", role: "alert" },
    h("p", {}, `Error: ${error.message}`),
    error.hint && h("p", { className: "soft" }, `What to do: ${error.hint}`),
    reload &&
      h("button", { type: "button", on: { click: () => location.reload() } }, "reload the page"),
  );
}

// What a page calls the option of commands that shows ROS's own rows.
export const INTERNAL = "what ROS does for itself";

export function notes(list) {
  if (!list?.length) return null;
  const named = document.querySelector("input.internal")
    ? (text) => text.replace("--internal", `“${INTERNAL}”`)
    : (text) => text;
  return h("ul", { className: "notes" }, list.map((text) => h("li", {}, named(text))));
}

export function command(text) {
  return text ? h("p", { className: "command" }, "the same numbers: ", h("code", {}, text)) : null;
}

// The commands of several tables, those that the numbers of a page come from.
export function commands(tables) {
  return tables.map((table) => command(table.meta.command));
}

// A text in SQL.
export const sqlText = (text) => `'${text.replaceAll("'", "''")}'`;

// The mark of a duration between clocks that are not synchronised, and what it means.
const DOUBT =
  "between hosts whose clocks are not synchronised: the difference of the clocks is in it";
export function doubt() {
  return h("abbr", { className: "doubt", title: DOUBT }, "†");
}
export function doubtHelp() {
  return h("p", { className: "soft" }, h("span", { className: "doubt" }, "†"), ` ${DOUBT}`);
}
