// A named query as a file: the header that msgflow reads, made of what DuckDB says of the columns.

const UNIT = / \[([^\]]+)\]$/;

// Options: title; described: the rows of DESCRIBE, with labels; words: what the views say.
export function queryFile(text, { title }, described, words) {
  const column = (label) => described.columns.find((one) => one.label === label).exact;
  const [names, types] = [column("column_name"), column("column_type")];
  const known = new Map();
  for (let row = 0; row < words.rows; row++) {
    if (words.kind[row] === "column" && words.description[row]) {
      known.set(`${words.name[row]} ${words.detail[row]}`, words.description[row]);
    }
  }
  const lines = names.map((one, at) => {
    const said = known.get(`${one} ${types[at]}`) ?? "";
    const unit = UNIT.exec(said)?.[1] ?? (/_ns$/.test(one) ? "ns" : null);
    return `-- column: ${one} ${types[at]}${unit ? ` [${unit}]` : ""}  ${
      said.replace(UNIT, "") || "…"
    }`;
  });
  const line = (value) => value.replaceAll(/\s+/g, " ").trim() || "…";
  const odd = names.filter((one) => !/^[A-Za-z_]\w*$/.test(one));
  return [
    `-- title: ${line(title)}`,
    `-- description: ${line(title)}.`,
    "-- grain: one row per …",
    ...lines,
    ...(odd.length
      ? [`-- Give these columns names of letters, digits and _: ${odd.map(line).join(", ")}`]
      : []),
    text.trim().replace(/;$/, ""),
    "",
  ].join("\n");
}
