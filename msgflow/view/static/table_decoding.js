// Tables that pages receive; msgflow/view/table_encoding.py describes their bytes.

export function decode(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const headLength = view.getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + headLength)));
  const table = { rows: head.rows, meta: head.meta, columns: [], units: {} };
  let at = 4 + headLength;
  for (const column of head.columns) {
    const body = bytes.subarray(at, at + column.bytes);
    table[column.name] = values(column, body, head.rows);
    table.columns.push({ name: column.name, unit: column.unit, type: column.type });
    at += column.bytes;
  }
  return table;
}

function values(column, body, rows) {
  switch (column.type) {
    case "double":
      return new Float64Array(body.slice(0, 8 * rows).buffer);
    case "json":
      return JSON.parse(new TextDecoder().decode(body));
    case "boolean":
      return Array.from(
        integers(column, body, rows),
        (value) => Number.isNaN(value) ? null : value === 1,
      );
    case "text": {
      const words = [null, ...JSON.parse(new TextDecoder().decode(body.subarray(0, column.words)))];
      const codes = integers(column, body.subarray(column.words), rows);
      return Array.from(codes, (code) => words[code]);
    }
    default:
      return integers(column, body, rows);
  }
}

function integers(column, body, rows) {
  const result = new Float64Array(rows);
  const { width, nulls } = column;
  let value = 0;
  for (let row = 0; row < rows; row++) {
    let folded = 0;
    let scale = 1;
    for (let plane = 0; plane < width; plane++) {
      folded += body[plane * rows + row] * scale;
      scale *= 256;
    }
    value += folded % 2 === 0 ? folded / 2 : -(folded + 1) / 2;
    result[row] = value;
  }
  if (nulls) {
    const missing = body.subarray(width * rows);
    for (let row = 0; row < rows; row++) if (missing[row]) result[row] = NaN;
  }
  return result;
}

// The rows as objects, for tables that are read, not drawn.
export function records(table) {
  return Array.from({ length: table.rows }, (_, row) => {
    const record = {};
    for (const { name } of table.columns) {
      const value = table[name][row];
      record[name] = typeof value === "number" && Number.isNaN(value) ? null : value;
    }
    return record;
  });
}
