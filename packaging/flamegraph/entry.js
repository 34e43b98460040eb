// What the section Functions takes from d3-flame-graph; `npm install && npm run build` makes one
// file of it.

export { default as flamegraph } from "d3-flame-graph";
export { select } from "d3-selection";
