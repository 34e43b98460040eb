// Elements made of names from a trace: text is only ever text, never markup.

export function h(tag, properties, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties ?? {})) {
    if (value === undefined || value === null || value === false) continue;
    if (name === "on") {
      for (const [event, action] of Object.entries(value)) element.addEventListener(event, action);
    } else if (name === "data") {
      Object.assign(element.dataset, value);
    } else if (name in element && name !== "list" && name !== "form") {
      element[name] = value;
    } else {
      element.setAttribute(name, value === true ? "" : value);
    }
  }
  append(element, children);
  return element;
}

export function svg(tag, attributes, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes ?? {})) {
    if (name === "on") {
      for (const [event, action] of Object.entries(value)) element.addEventListener(event, action);
    } else if (value !== undefined && value !== null) {
      element.setAttribute(name, value);
    }
  }
  append(element, children);
  return element;
}

function append(element, children) {
  for (const child of children.flat(Infinity)) {
    if (child === undefined || child === null || child === false) continue;
    element.append(child instanceof Node ? child : String(child));
  }
}

export function clear(element, ...children) {
  element.replaceChildren();
  append(element, children);
  return element;
}

// What the style sheet says of a colour: pages draw with the same names in light and dark.
export function color(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

// Long names may be broken where their parts meet, so that they are not broken within a word.
const LONG_WORD = 18;
export function breakable(text) {
  return String(text).split(" ").flatMap((
    word,
    at,
  ) => [
    at ? " " : "",
    ...(word.length <= LONG_WORD
      ? [word]
      : word.split(/(?<=[^/(])(?=\/)|(?<=[(_,])(?=[^\s])|(?<=[a-z0-9])(?=[A-Z])/).flatMap((
        part,
        place,
      ) => (place ? [h("wbr"), part] : [part]))),
  ]);
}
