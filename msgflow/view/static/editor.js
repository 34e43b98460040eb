// The editor of SQL: CodeMirror, which knows the views and their columns.

import { h } from "./dom.js";

const NO_NAMES = ["QuotedIdentifier", "String", "LineComment", "BlockComment"];

// Returns { root, text(), set(text), insert(text), mark(line) }. The library is that of codemirror.min.js; words is
// the table of the views, columns, macros, functions, types and keywords. Options: text, run(),
// changed().
export function sqlEditor(library, words, { text, run, changed }) {
  const { EditorView, EditorState, Decoration, StateEffect, StateField, keymap } = library;
  const marked = StateEffect.define();
  const marks = StateField.define({
    create: () => Decoration.none,
    // What is typed may be right now.
    update: (known, transaction) =>
      transaction.effects.filter((effect) => effect.is(marked))
        .reduce((_, effect) => effect.value, transaction.docChanged ? Decoration.none : known),
    provide: (field) => EditorView.decorations.from(field),
  });
  const { dialect, sources } = vocabulary(library, words);
  // A page has no styles but its own. In a shadow root CodeMirror needs no element for its styles.
  const root = h("div", { className: "editor" });
  const shadow = root.attachShadow({ mode: "open" });
  const view = new EditorView({
    root: shadow,
    parent: shadow,
    state: EditorState.create({
      doc: text,
      extensions: [
        library.lineNumbers(),
        library.history(),
        library.drawSelection(),
        library.bracketMatching(),
        library.closeBrackets(),
        library.autocompletion({ icons: false, maxRenderedOptions: 60 }),
        dialect.language,
        sources.map((autocomplete) => dialect.language.data.of({ autocomplete })),
        library.syntaxHighlighting(highlights(library)),
        marks,
        EditorView.lineWrapping,
        EditorView.theme(THEME),
        EditorView.contentAttributes.of({ "aria-label": "SQL", spellcheck: "false" }),
        EditorView.domEventHandlers({
          beforeinput: (event, own) => typedOver(library, event, own),
        }),
        library.placeholder("SELECT … FROM …"),
        keymap.of([
          {
            key: "Mod-Enter",
            run: () => {
              run();
              return true;
            },
          },
          ...library.closeBracketsKeymap,
          ...library.completionKeymap,
          ...library.historyKeymap,
          ...library.defaultKeymap,
        ]),
        EditorView.updateListener.of((update) => {
          if (update.docChanged) changed();
        }),
      ],
    }),
  });
  return {
    root,
    text: () => view.state.doc.toString(),
    set: (value) =>
      view.dispatch({ changes: { from: 0, to: view.state.doc.length, insert: value } }),
    // In place of what is selected.
    insert(value) {
      view.dispatch(view.state.replaceSelection(value));
      view.focus();
    },
    // Marks a line, counted from 1; none when it is null.
    mark(line) {
      const { doc } = view.state;
      const place = line === null || line > doc.lines ? null : doc.line(line).from;
      const decoration = Decoration.line({ class: "wrong" });
      view.dispatch({
        effects: [
          marked.of(place === null ? Decoration.none : Decoration.set([decoration.range(place)])),
          ...(place === null ? [] : [EditorView.scrollIntoView(place)]),
        ],
      });
    },
  };
}

// Where text is typed over lines, Chromium would give a line their style, which the policy of the page
// forbids. So CodeMirror is told, as it would be after the change.
function typedOver({ EditorView }, event, view) {
  const { from, to, empty } = view.state.selection.main;
  if (event.inputType !== "insertText" || !event.data || empty || view.composing) return false;
  const insert = () =>
    view.state.update(view.state.replaceSelection(event.data), {
      userEvent: "input.type",
      scrollIntoView: true,
    });
  event.preventDefault();
  if (
    !view.state.facet(EditorView.inputHandler).some((handler) =>
      handler(view, from, to, event.data, insert)
    )
  ) view.dispatch(insert());
  return true;
}

function vocabulary(
  { SQLDialect, ifNotIn, keywordCompletionSource, schemaCompletionSource },
  words,
) {
  const named = { keyword: [], function: [], type: [] };
  const schema = new Map();
  const columns = new Map();
  for (let row = 0; row < words.rows; row++) {
    const [kind, name, view] = [words.kind[row], words.name[row], words.view[row]];
    const option = {
      label: name,
      detail: words.detail[row] ?? undefined,
      info: words.description[row] ?? undefined,
    };
    if (kind === "column") {
      if (!columns.has(view)) columns.set(view, []);
      columns.get(view).push({ ...option, type: "property", boost: 1 });
    } else if (kind === "view") schema.set(name, { ...option, type: "class", boost: 2 });
    else if (kind === "macro") schema.set(name, { ...option, type: "function", boost: 1 });
    else named[kind].push(name);
  }
  const dialect = SQLDialect.define({
    keywords: named.keyword.join(" "),
    builtin: named.function.join(" "),
    types: named.type.join(" "),
    doubleDollarQuotedStrings: true,
    operatorChars: "*+-%<>!=&|^/~?:",
  });
  const listed = [...schema].map((
    [name, self],
  ) => [name, { self, children: columns.get(name) ?? [] }]);
  const spelled = (label, type) => ({
    label: type === "keyword" ? label.toUpperCase() : label,
    type,
    boost: -1,
  });
  // Behind a dot only columns can follow.
  const withoutDot = (source) =>
    ifNotIn(NO_NAMES, (context) => (context.matchBefore(/\.\w*/) ? null : source(context)));
  // The columns of all views that the text names, also without a name in front.
  const columnsOf = (context) => {
    const word = context.matchBefore(/\w+/);
    if (!word && !context.explicit) return null;
    const found = new Set(context.state.doc.toString().match(/\w+/g));
    const options = new Map(
      [...found].flatMap((name) => columns.get(name) ?? []).map((option) => [option.label, option]),
    );
    return { from: word?.from ?? context.pos, options: [...options.values()], validFor: /^\w*$/ };
  };
  return {
    dialect,
    sources: [
      schemaCompletionSource({ dialect, schema: Object.fromEntries(listed) }),
      withoutDot(columnsOf),
      withoutDot(keywordCompletionSource(dialect, false, spelled)),
    ],
  };
}

function highlights({ HighlightStyle, tags }) {
  return HighlightStyle.define([
    { tag: [tags.keyword, tags.operatorKeyword], color: "var(--focus)", fontWeight: "600" },
    { tag: [tags.string, tags.special(tags.string)], color: "var(--take)" },
    { tag: [tags.number, tags.bool, tags.null], color: "var(--process)" },
    { tag: [tags.typeName], color: "var(--service)" },
    { tag: [tags.standard(tags.name)], color: "var(--blocked)" },
    { tag: [tags.comment], color: "var(--soft)", fontStyle: "italic" },
  ]);
}

const THEME = {
  "&": {
    border: "1px solid var(--line)",
    borderRadius: "6px",
    background: "var(--page)",
    color: "var(--ink)",
    fontSize: "14px",
    maxHeight: "24rem",
  },
  "&.cm-focused": { outline: "2px solid var(--focus)", outlineOffset: "-1px" },
  ".cm-scroller": { fontFamily: 'ui-monospace, "DejaVu Sans Mono", monospace', lineHeight: "1.5" },
  ".cm-content, .cm-gutter": { minHeight: "8rem" },
  ".cm-content": { caretColor: "var(--ink)" },
  ".cm-cursor": { borderLeftColor: "var(--ink)" },
  ".cm-gutters": {
    background: "var(--panel)",
    color: "var(--soft)",
    borderRight: "1px solid var(--line)",
    borderRadius: "6px 0 0 6px",
  },
  "&.cm-focused > .cm-scroller > .cm-selectionLayer .cm-selectionBackground, .cm-selectionBackground":
    { background: "color-mix(in srgb, var(--focus) 28%, var(--page))" },
  "&.cm-focused .cm-matchingBracket": {
    background: "var(--stripe)",
    outline: "1px solid var(--faint)",
  },
  ".wrong": {
    background: "color-mix(in srgb, var(--error) 16%, var(--page))",
    boxShadow: "inset 3px 0 var(--error)",
  },
  ".cm-tooltip": {
    background: "var(--page)",
    color: "var(--ink)",
    border: "1px solid var(--faint)",
    borderRadius: "6px",
    boxShadow: "0 4px 16px rgba(0, 0, 0, .22)",
  },
  ".cm-tooltip.cm-tooltip-autocomplete > ul": {
    maxHeight: "14rem",
    fontFamily: 'ui-monospace, "DejaVu Sans Mono", monospace',
  },
  ".cm-tooltip-autocomplete ul li[aria-selected]": {
    background: "var(--focus)",
    color: "var(--page)",
  },
  ".cm-tooltip.cm-completionInfo": { maxWidth: "min(24rem, 80vw)", padding: ".4rem .6rem" },
  ".cm-completionDetail": { color: "var(--soft)", fontStyle: "normal" },
  ".cm-tooltip-autocomplete ul li[aria-selected] .cm-completionDetail": { color: "inherit" },
  ".cm-placeholder": { color: "var(--soft)" },
};
