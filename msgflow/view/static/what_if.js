// What if: changes of the system, and what a replay says that they do to each path.

import { breakable, clear, h } from "./dom.js";
import { current, replace } from "./address.js";
import { duration, pathText, shellQuoted } from "./labels.js";
import { dataTable } from "./table.js";
import { command, failed, notes, waiting } from "./notice.js";
import { breakdownStack, partsOf } from "./paths.js";

const COLUMNS_OF_REMEDIES = [
  "path",
  "recorded_ns",
  "predicted_ns",
  "gain_ns",
  "gain_low_ns",
  "gain_high_ns",
  "recorded_p95_ns",
  "predicted_p95_ns",
  "p95_gain_ns",
  "p95_low_ns",
  "p95_high_ns",
  "flows",
  "predicted_flows",
  "doubt",
];

export class WhatIfPage {
  constructor(app, root) {
    this.app = app;
    this.root = root;
    this.ready = this.build();
  }

  async build() {
    clear(this.root, waiting("looking for what may help …"));
    const [remedies, breakdown] = await Promise.all([
      this.app.fetch("remedy"),
      this.app.query("path-breakdown"),
    ]);
    this.breakdown = breakdown;
    this.chosen = new Set(asked());
    this.path = current().of ?? breakdown.path[0];
    const known = Array.from({ length: remedies.rows }, (_, row) => remedies.change[row]);
    const controls = new Set([...known, ...this.chosen]);
    this.controls = h("div", { className: "remedies" });
    for (const change of controls) {
      const row = known.indexOf(change);
      this.controls.append(this.control(change, row < 0 ? "your own" : remedies.remedy[row]));
    }
    const own = h("input", {
      type: "text",
      size: 44,
      placeholder: "threads(/perception)=2",
      "aria-label": "a change of your own",
    });
    const form = h(
      "form",
      {
        on: {
          submit: (event) => {
            event.preventDefault();
            const text = own.value.trim();
            if (!text || this.chosen.has(text)) return;
            this.chosen.add(text);
            this.controls.append(this.control(text, "your own"));
            own.value = "";
            this.show();
          },
        },
      },
      own,
      " ",
      h("button", { type: "submit" }, "add"),
    );
    this.result = h("div");
    clear(
      this.root,
      h(
        "section",
        {},
        h("h2", {}, "What if"),
        h(
          "p",
          { className: "soft" },
          "Choose what is changed: a replay of the run says what that does to each path. First come changes of what takes most time.",
        ),
        this.controls,
        form,
      ),
      this.result,
    );
    await this.show();
  }

  control(change, title) {
    const box = h("input", {
      type: "checkbox",
      checked: this.chosen.has(change),
      on: {
        change: () => {
          if (box.checked) this.chosen.add(change);
          else this.chosen.delete(change);
          this.show();
        },
      },
    });
    return h(
      "label",
      { className: "remedy" },
      box,
      ` ${String(title).replaceAll("_", " ")} `,
      h("code", {}, breakable(change)),
    );
  }

  async show() {
    const changes = JSON.stringify([...this.chosen]);
    replace({ page: "what_if", set: this.chosen.size ? changes : null, of: this.path });
    this.app.linksMoved();
    if (!this.chosen.size) {
      clear(this.result, h("section", {}, h("p", {}, "Nothing is changed yet.")));
      return;
    }
    clear(this.result, waiting("replaying …"));
    const now = this.asking = {};
    try {
      const gains = await this.app.fetch("what_if", { changes });
      if (now !== this.asking) return;
      this.gains = gains;
      this.parts = null;
      this.draw();
      const parts = await this.app.fetch("what_if_part", { changes });
      if (now !== this.asking) return;
      this.parts = parts;
      this.draw();
    } catch (error) {
      if (now === this.asking) clear(this.result, failed(error));
    }
  }

  draw() {
    const words = [...this.chosen].map((change) => `--set ${shellQuoted(change)}`).join(" ");
    clear(
      this.result,
      h(
        "section",
        {},
        h("h2", { className: "path-title" }, breakable(pathText(this.path ?? ""))),
        this.compared(),
      ),
      h(
        "section",
        {},
        h("h3", {}, "All paths"),
        dataTable(this.gains, {
          columns: COLUMNS_OF_REMEDIES.filter((name) =>
            name !== "doubt" || this.gains.doubt.some(Boolean)
          ),
          label: "what changes do to paths",
          sort: { name: "gain_ns", down: true },
          picked: (row) => this.gains.path[row] === this.path,
          onPick: (row) => {
            this.path = this.gains.path[row];
            replace({ of: this.path });
            this.draw();
          },
        }),
        notes(this.gains.meta.notes),
        command(`msgflow predict ${words} --run ${shellQuoted(this.app.run.name)}`),
      ),
    );
  }

  // The parts of the chosen path, as recorded and as predicted, on one scale.
  compared() {
    const row = Array.from(this.gains.path).indexOf(this.path);
    const said = row < 0 ? null : this.gains.headline[row] ?? this.gains.doubt[row];
    const sides = [["recorded", this.breakdown], ["predicted", this.parts]].map((
      [title, table],
    ) => [title, table, table ? ownRows(table, this.path) : []]);
    const whole = Math.max(...sides.map(([, table, rows]) => table ? partsOf(table, rows) : 0));
    return [
      said && h("p", {}, said),
      sides.map(([title, table, rows]) => {
        if (!table) return waiting("taking the predicted latency apart …");
        if (!rows.length) return h("p", {}, `${title}: no flow reaches the end`);
        const [stack, legend] = breakdownStack(table, rows, this.root.clientWidth, whole);
        return [
          h("p", { className: "soft" }, `${title}: ${duration(partsOf(table, rows))} on average`),
          stack,
          title === "predicted" && legend,
        ];
      }),
    ];
  }
}

function asked() {
  try {
    return JSON.parse(current().set ?? "[]").map(String);
  } catch {
    return [];
  }
}

function ownRows(table, path) {
  return Array.from({ length: table.rows }, (_, row) => row).filter((row) =>
    table.path[row] === path
  );
}
