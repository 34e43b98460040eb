// Marks on axes of time: what happened in the run, besides what is measured.

import { pageAddress } from "./address.js";
import { momentAxis } from "./labels.js";

// A mark that is farther away from the pointer is not meant [pixels].
export const NEAR_MARK = 6;

// What happened, and the colour of its mark.
const MARK_COLORS = {
  node: "soft",
  object: "soft",
  restart: "error",
  state: "active",
  parameter: "event",
  goal: "service",
  request: "call",
  program: "process",
  clock: "warning",
  loss: "error",
};
export const markWords = (at, sentences, number) =>
  `${momentAxis(Math.round(at / 1e6) * 1e6)}: ${sentences.join(", ")}${
    number > sentences.length ? ` and ${number - sentences.length} more` : ""
  }`;

// What happened in the run: {at, color, text} by time. A file may not hold it.
export async function happened(app) {
  const marks = await app.fetch("mark").catch(() => ({ rows: 0 }));
  return Array.from({ length: marks.rows }, (_, row) => ({
    at: marks.start_at[row],
    color: MARK_COLORS[marks.kind[row]],
    text: markWords(marks.start_at[row], marks.sentences[row], marks.count[row]),
  }));
}

// The mark that is nearest to a moment, as far as `within` says.
export function nearestMark(marks, at, within) {
  let best = null;
  for (const mark of marks) {
    const far = Math.abs(mark.at - at);
    if (far <= within && (!best || far < Math.abs(best.at - at))) best = mark;
  }
  return best;
}

// Where the timeline shows a moment.
export function aroundMoment(app, at) {
  const around = Math.min(500e6, app.run.length / 20);
  return pageAddress("timeline", {
    from: Math.max(Math.round(at - around), 0),
    to: Math.round(at + around),
  });
}
