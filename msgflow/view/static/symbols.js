// Symbols of C++ as people say them: without arguments of templates and functions. Those of Python
// are `module:function`.

const LONGEST = 120;
const BIND = /^std::_Bind<[^(]*\(([\w:]+)::\*/;

export function shortSymbol(symbol) {
  if (/^[^\s:(<]+:[^:]/.test(symbol)) return symbol.replaceAll(".<locals>", "").slice(0, LONGEST);
  const bound = BIND.exec(symbol);
  if (bound) return `bound method of ${bound[1]}`;
  let [short, depth] = ["", 0];
  for (const letter of symbol) {
    if (letter === "<" || letter === "(") depth++;
    if (depth === 0) short += letter;
    if ((letter === ">" || letter === ")") && depth > 0) depth--;
  }
  short = short.replace(/\s+/g, " ").replace(/ (const|&)+$/, "").trim();
  // Of a type of functions nothing would be left.
  const text = /\w/.test(short) && short !== "void" ? short : symbol;
  return text.length > LONGEST ? `${text.slice(0, LONGEST - 1)}…` : text;
}
