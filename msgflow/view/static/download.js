// Downloads: what a chart shows as a file of its numbers, or of its picture.

import { color, h } from "./dom.js";

const TITLE_HEIGHT = 30;

// Options: name (of the files, and title of the picture), columns (of [title, values]) and canvases,
// functions that return what is shown at the moment of the click.
export function downloads({ name, columns, canvases }) {
  const file = name.replaceAll(/[^\w-]+/g, "_").replaceAll(/^_+|_+$/g, "") || "chart";
  const button = (kind, action) =>
    h("button", {
      type: "button",
      title: `download as ${kind}`,
      "aria-label": `${name} as ${kind}`,
      on: { click: action },
    }, kind);
  return h(
    "div",
    { className: "downloads" },
    button(
      "CSV",
      () => saveFile(new Blob([csvText(columns())], { type: "text/csv" }), `${file}.csv`),
    ),
    button(
      "PNG",
      () => painted(name, canvases()).toBlob((blob) => saveFile(blob, `${file}.png`), "image/png"),
    ),
  );
}

export function csvText(columns) {
  const lines = [columns.map(([title]) => csvField(title)).join(",")];
  const rows = Math.max(0, ...columns.map(([, values]) => values.length));
  for (let row = 0; row < rows; row++) {
    lines.push(columns.map(([, values]) => csvField(values[row])).join(","));
  }
  return `${lines.join("\n")}\n`;
}

// As the command line writes CSV: text in quotes, and nothing that a spreadsheet takes for a formula.
function csvField(value) {
  if (value === null || value === undefined || (typeof value === "number" && Number.isNaN(value))) {
    return "";
  }
  if (typeof value === "number" || typeof value === "boolean") return String(value);
  const safe = /^[=+\-@\t\r]/.test(value) ? `'${value}` : String(value);
  return `"${safe.replaceAll('"', '""')}"`;
}

// The canvases one below the other, with the title, on the colour of the page.
function painted(title, canvases) {
  const ratio = devicePixelRatio || 1;
  const top = TITLE_HEIGHT * ratio;
  const result = document.createElement("canvas");
  result.width = Math.max(...canvases.map((one) => one.width), 1);
  result.height = top + canvases.reduce((sum, one) => sum + one.height, 0);
  const context = result.getContext("2d");
  context.fillStyle = color("page");
  context.fillRect(0, 0, result.width, result.height);
  context.fillStyle = color("ink");
  context.font = `${13 * ratio}px system-ui, sans-serif`;
  context.fillText(title, 8 * ratio, 20 * ratio);
  let y = top;
  for (const one of canvases) {
    context.drawImage(one, 0, y);
    y += one.height;
  }
  return result;
}

export function saveFile(blob, name) {
  const link = h("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
