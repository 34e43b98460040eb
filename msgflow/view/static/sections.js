// Sections of a page that come when they are read: one that has nothing to show is not there.

import { clear, h } from "./dom.js";
import { current } from "./address.js";
import { redrawCharts } from "./chart.js";
import { failed, waiting } from "./notice.js";

export class Sections {
  // `makers`: what reads a section by its title. Each returns its elements; null where it is empty.
  constructor(makers) {
    this.places = Object.keys(makers).map((title) =>
      h("div", { data: { section: title.toLowerCase() } }, waiting())
    );
    this.links = h("span", { className: "group" });
    this.complete = Promise.all(
      Object.values(makers).map((make, at) => this.fill(this.places[at], make)),
    ).then(() => this.link(Object.keys(makers)));
  }

  async fill(place, make) {
    try {
      clear(place, await make());
    } catch (error) {
      if (error.name !== "AbortError") clear(place, failed(error));
    }
  }

  // Buttons that lead to the sections, and the way to the one that the address names.
  link(titles) {
    const shown = this.places.filter((place) => place.firstChild);
    clear(
      this.links,
      shown.map((place) =>
        h(
          "button",
          { type: "button", on: { click: () => place.scrollIntoView({ behavior: "smooth" }) } },
          titles[this.places.indexOf(place)],
        )
      ),
    );
    shown.find((place) => place.dataset.section === current().section)?.scrollIntoView();
    redrawCharts();
  }
}
