// A picture as a file: SVG with the colours of the page in it, or PNG made of that.

import { h } from "./dom.js";

const STYLED = [
  "fill",
  "stroke",
  "stroke-width",
  "stroke-dasharray",
  "font",
  "text-anchor",
  "paint-order",
];
const SCALE = 2;

// The SVG on its own: what the style sheet says of its elements is written into them.
export function standalone(svg) {
  const copy = svg.cloneNode(true);
  const originals = svg.querySelectorAll("*");
  copy.querySelectorAll("*").forEach((element, place) => {
    const computed = getComputedStyle(originals[place]);
    for (const name of STYLED) {
      const value = computed.getPropertyValue(name);
      if (value) element.style.setProperty(name, value);
    }
  });
  const { width, height } = svg.viewBox.baseVal;
  copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
  copy.setAttribute("width", width);
  copy.setAttribute("height", height);
  copy.style.background = getComputedStyle(document.body).backgroundColor;
  return new XMLSerializer().serializeToString(copy);
}

export function saveSvg(svg, name) {
  save(dataAddress(standalone(svg)), `${name}.svg`);
}

export async function savePng(svg, name) {
  const { width, height } = svg.viewBox.baseVal;
  const image = new Image();
  image.src = dataAddress(standalone(svg));
  await image.decode();
  const canvas = h("canvas", {
    width: Math.ceil(width * SCALE),
    height: Math.ceil(height * SCALE),
  });
  const context = canvas.getContext("2d");
  context.fillStyle = getComputedStyle(document.body).backgroundColor;
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.drawImage(image, 0, 0, canvas.width, canvas.height);
  save(canvas.toDataURL("image/png"), `${name}.png`);
}

// The policy of the pages allows pictures as data alone.
function dataAddress(text) {
  return `data:image/svg+xml;charset=utf-8,${encodeURIComponent(text)}`;
}

function save(address, name) {
  h("a", { href: address, download: name }).click();
}
