// Help of the timeline: what keys and gestures do.

import { h } from "./dom.js";

const KEYS = [
  ["← → or A D, drag", "move in time"],
  ["↑ ↓, wheel", "move between rows"],
  ["+ − or W S, Ctrl and wheel, pinch, drag along the times", "zoom"],
  ["F", "show all"],
  ["click", "pick a bar, fold a host, process or node, hide a row"],
  ["N P", "next and previous bar of the row"],
  ["double click", "zoom to a bar"],
  ["M, or Shift and drag", "measure; over several rows: sums of their callbacks and threads"],
  ["B", "pin the row under the pointer to the top, or let it go"],
  ["/", "search"],
  ["Escape", "let go"],
  ["?", "this help"],
];

export function helpDialog() {
  const dialog = h(
    "dialog",
    { className: "help", "aria-label": "help" },
    h("h2", {}, "Keys and gestures"),
    h("dl", {}, KEYS.map(([keys, does]) => [h("dt", {}, keys), h("dd", {}, does)])),
    h("form", { method: "dialog" }, h("button", {}, "close")),
  );
  dialog.addEventListener("click", (event) => {
    if (event.target === dialog) dialog.close();
  });
  return dialog;
}
