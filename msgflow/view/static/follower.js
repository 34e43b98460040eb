// Pages of a recording that goes on: each new window replaces the last one, until somebody looks
// closer.

import { h } from "./dom.js";
import { current, go } from "./address.js";

const LEAST_PAUSE = 2000;
// Pages that somebody works on.
const STAYING = ["sql", "compare"];

export class Follower {
  constructor(app, root) {
    this.app = app;
    this.isFollowing = true;
    this.button = h("button", {
      type: "button",
      title: "show each new window; a click into the page stops it",
      on: { click: () => this.set(!this.isFollowing) },
    }, "follow");
    this.said = h("span", { className: "soft", role: "status" });
    root.append(h("div", { className: "follower" }, this.button, this.said));
    for (const kind of ["pointerdown", "keydown"]) {
      app.main.addEventListener(kind, () => this.set(false));
    }
    this.set(true);
    this.run();
  }

  set(isFollowing) {
    this.button.setAttribute("aria-pressed", String(isFollowing));
    if (isFollowing === this.isFollowing) return;
    this.isFollowing = isFollowing;
    const { page, from, to } = current();
    // Numbers of flows and paths are those of one window.
    if (isFollowing) {
      go({
        ...Object.fromEntries(Object.keys(current()).map((name) => [name, null])),
        page,
        from,
        to,
      });
    }
  }

  async run() {
    for (;;) {
      const begin = performance.now();
      let said = "";
      try {
        if (this.isDue()) await this.step();
      } catch (error) {
        said = error.message;
      }
      this.said.textContent = said;
      // At most half of the time goes into it.
      await new Promise((done) => {
        setTimeout(done, Math.max(LEAST_PAUSE, performance.now() - begin));
      });
    }
  }

  isDue() {
    return this.isFollowing && !document.hidden && !STAYING.includes(current().page);
  }

  async step() {
    const { source } = this.app;
    await source.get("prepare");
    // What the page still asks is of the window that it shows.
    await this.app.page?.complete;
    // Preparing takes so long that somebody may have clicked.
    if (!this.isDue()) return;
    const generation = await (await source.get("show")).text();
    if (generation !== source.generation) await this.app.moveOn(generation);
  }
}
