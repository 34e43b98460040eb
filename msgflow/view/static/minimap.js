// The whole run in a strip below the timeline: how busy it was, and where the window lies.

import { color, h } from "./dom.js";
import { usualMost } from "./labels.js";

const HEIGHT = 34;

export class Minimap {
  // `move(from, to)` is called with the window that is asked for, in nanoseconds since the start.
  constructor(length, move) {
    this.length = length;
    this.move = move;
    this.shares = null;
    this.marks = [];
    this.view = { from: 0, to: length };
    this.canvas = h("canvas", {
      className: "minimap",
      role: "img",
      "aria-label": "the whole run; a click moves the window",
    });
    let grabbed = null;
    const at = (event) => {
      const box = this.canvas.getBoundingClientRect();
      return ((event.clientX - box.left) / Math.max(box.width, 1)) * this.length;
    };
    this.canvas.addEventListener("pointerdown", (event) => {
      const time = at(event);
      const { from, to } = this.view;
      grabbed = time >= from && time <= to ? time - from : (to - from) / 2;
      this.canvas.setPointerCapture(event.pointerId);
      this.move(time - grabbed, time - grabbed + to - from);
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (grabbed === null) return;
      const from = at(event) - grabbed;
      this.move(from, from + this.view.to - this.view.from);
    });
    for (const name of ["pointerup", "pointercancel"]) {
      this.canvas.addEventListener(name, () => {
        grabbed = null;
      });
    }
  }

  // Bars of callbacks, in as many pieces as the strip is wide; a busy piece is as high as it.
  fill(table) {
    const pieces = 600;
    const shares = new Float64Array(pieces);
    for (let row = 0; row < table.rows; row++) {
      if (table.kind[row] !== 0) continue;
      const busy = table.busy ? table.busy[row] : table.length[row];
      const first = Math.max(Math.floor((table.start_at[row] / this.length) * pieces), 0);
      const last = Math.min(
        Math.floor(((table.start_at[row] + table.length[row]) / this.length) * pieces),
        pieces - 1,
      );
      for (let piece = first; piece <= last; piece++) shares[piece] += busy / (last - first + 1);
    }
    const most = usualMost(shares);
    this.shares = shares.map((share) => Math.min(share / most, 1));
    this.canvas.dataset.filled = "1";
    this.draw(this.view);
  }

  draw(view) {
    this.view = view;
    const { canvas } = this;
    const width = Math.max(canvas.clientWidth, 50);
    const ratio = devicePixelRatio || 1;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(HEIGHT * ratio);
    const c = canvas.getContext("2d");
    c.scale(ratio, ratio);
    c.fillStyle = color("panel");
    c.fillRect(0, 0, width, HEIGHT);
    if (this.shares) {
      c.fillStyle = color("subscription");
      const step = width / this.shares.length;
      this.shares.forEach((share, piece) =>
        c.fillRect(piece * step, HEIGHT * (1 - share), Math.max(step, 1), HEIGHT * share)
      );
    }
    const x = (at) => Math.min(Math.max((at / this.length) * width, 0), width);
    for (const mark of this.marks) {
      c.fillStyle = color(mark.color);
      c.fillRect(x(mark.at) - 1, 0, 2, 7);
    }
    const [left, right] = [x(view.from), Math.max(x(view.to), x(view.from) + 2)];
    c.fillStyle = color("focus");
    c.globalAlpha = 0.18;
    c.fillRect(left, 0, right - left, HEIGHT);
    c.globalAlpha = 1;
    c.strokeStyle = color("focus");
    c.lineWidth = 1.5;
    c.strokeRect(left + 0.75, 0.75, Math.max(right - left - 1.5, 1), HEIGHT - 1.5);
  }
}
