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

// What a note of the command line says to type there: its last clause, or all of it.
const TYPED = /(?:[;:] | \()[^;:(]*(?:\bmsgflow |--\w)[^;]*$/;
const IS_TYPED = /(?:^| )(?:msgflow |--)\w/;

export function notes(list) {
  const texts = (list ?? []).map((text) =>
    (document.querySelector("input.internal") ? text.replace("--internal", `“${INTERNAL}”`) : text)
      .replace(TYPED, "")
  ).filter((text) => !IS_TYPED.test(text));
  return texts.length > 0 &&
    h("ul", { className: "notes" }, [...new Set(texts)].map((text) => h("li", {}, text)));
}

// The commands that print the numbers beside them.
export function command(...texts) {
  const codes = texts.filter(Boolean).map((text) => h("code", {}, text));
  return codes.length > 0 && h(
    "p",
    { className: "command" },
    "the same numbers: ",
    codes.map((code, at) => [at > 0 && " · ", code]),
  );
}

export const commands = (tables) => command(...tables.map((table) => table.meta.command));

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
