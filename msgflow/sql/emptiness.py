"""What an SQL statement can have no row without.

DuckDB takes milliseconds to plan a statement of some joins, also where there is nothing to join.
Most of what can be recorded is missing from a given trace, and so are the rows that are made of it:
that follows from the text of the statements, and nothing has to be planned.

A condition says when a statement has no row for certain: the name of a table, which is to be empty,
or a list of conditions behind 'all' or 'any'. Where the text leaves a doubt, it never holds.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import duckdb

Condition = str | list[Any]
"""The name of a table, or 'all' or 'any' and conditions."""

NEVER: Condition = ["any"]

_ALWAYS: Condition = ["all"]
_MACRO = re.compile(
    r"(?:--[^\n]*\n|\s)*CREATE OR REPLACE MACRO (?P<name>[\w.]+)\((?P<params>[^()]*)\) AS\s+"
    r"(?P<table>TABLE\s)?"
)
# Of joins whose rows are those of the left side, at most.
_LEFT = ("LEFT", "ANTI", "SINGLE", "MARK")
# Macros and list functions of DuckDB that give each row a value, as its scalar functions do.
_OF_EACH_ROW = (
    "array_to_string", "list_append", "list_avg", "list_max", "list_min", "list_prepend",
    "list_sum", "nullif", "range", "unnest",
)  # fmt: skip
# What may hold an aggregate, which makes a row of nothing.
_AGGREGATING = ("select_list", "having", "qualify", "modifiers")


@dataclass(frozen=True)
class Macro:
    """A macro.

    Attributes:
        params: names of its parameters.
        node: its statement, parsed; of a scalar macro, its expression as the only column.
        is_scalar: it is no table macro.
    """

    params: tuple[str, ...]
    node: dict[str, Any]
    is_scalar: bool


def macro(con: duckdb.DuckDBPyConnection, statement: str) -> tuple[str, Macro]:
    """Return name and content of the macro that a statement creates.

    Raises:
        ValueError: it creates none.
    """
    found = _MACRO.match(statement)
    if found is None:
        raise ValueError(f"no macro: {statement}")
    params = (param.partition(":=")[0].strip() for param in found["params"].split(","))
    body = statement[found.end() :]
    is_scalar = found["table"] is None
    node = _parsed(con, f"SELECT {body}" if is_scalar else body)
    return found["name"], Macro(tuple(params), node, is_scalar)


def condition(con: duckdb.DuckDBPyConnection, query: str, macros: Mapping[str, Macro]) -> Condition:
    """Return when a query has no row for certain.

    Args:
        con: any connection; it parses.
        query: one SELECT.
        macros: macros that it may use, by name; of others nothing is known.
    """
    return _Reading(macros, _scalar_functions(con)).node(_parsed(con, query), {})


def condition_of_macro(
    con: duckdb.DuckDBPyConnection, name: str, macros: Mapping[str, Macro]
) -> Condition:
    """Return when one of these table macros has no row for certain, whatever its arguments."""
    return _Reading(macros, _scalar_functions(con)).node(macros[name].node, {})


def holds(condition: Condition, is_empty: Callable[[str], bool]) -> bool:
    """Tell whether a condition holds, where `is_empty` tells it of tables."""
    if isinstance(condition, str):
        return is_empty(condition)
    word, *rest = condition
    return (all if word == "all" else any)(holds(part, is_empty) for part in rest)


def _parsed(con: duckdb.DuckDBPyConnection, query: str) -> dict[str, Any]:
    row = con.execute("SELECT json_serialize_sql(?::VARCHAR)", [query]).fetchone()
    tree: dict[str, Any] = json.loads(row[0]) if row else {"error": True}
    if tree["error"]:
        raise ValueError(f"{tree.get('error_message')}: {query}")
    node: dict[str, Any] = tree["statements"][0]["node"]
    return node


@lru_cache(maxsize=1)
def _scalar_functions(con: duckdb.DuckDBPyConnection) -> frozenset[str]:
    """Return the functions that make no row of nothing."""
    rows = con.execute(
        "SELECT function_name FROM duckdb_functions() GROUP BY function_name "
        "HAVING bool_and(internal AND function_type = 'scalar')"
    ).fetchall()
    return frozenset(name for (name,) in rows) | set(_OF_EACH_ROW)


def _all(conditions: list[Condition]) -> Condition:
    return _joined("all", _ALWAYS, NEVER, conditions)


def _any(conditions: list[Condition]) -> Condition:
    return _joined("any", NEVER, _ALWAYS, conditions)


def _joined(
    word: str, neutral: Condition, ruling: Condition, conditions: list[Condition]
) -> Condition:
    parts: list[Condition] = []
    for part in conditions:
        # Of the same word, it is flattened; an empty one says nothing.
        for one in part[1:] if isinstance(part, list) and part[0] == word else [part]:
            if one == ruling:
                return ruling
            if one not in parts:
                parts.append(one)
    return parts[0] if len(parts) == 1 else [word, *parts] if parts else neutral


# Names of common table expressions -> their conditions, and of parameters -> their texts.
_Scope = dict[str, Any]


class _Reading:
    """Walks the tree of a query, as `json_serialize_sql` gives it."""

    def __init__(self, macros: Mapping[str, Macro], scalar: frozenset[str]) -> None:
        self._macros = macros
        self._scalar = scalar

    def node(self, node: dict[str, Any], scope: _Scope) -> Condition:
        scope = dict(scope)
        for entry in (node.get("cte_map") or {}).get("map", []):
            scope[entry["key"]] = self.node(entry["value"]["query_node"], scope)
        kind = node["type"]
        if kind == "SELECT_NODE":
            return self._select(node, scope)
        if kind == "SET_OPERATION_NODE":
            return self._set_operation(node, scope)
        if kind == "RECURSIVE_CTE_NODE":
            # From nothing, it goes on with what nothing leads to.
            first = self.node(node["left"], scope)
            return _all([first, self.node(node["right"], scope | {node["cte_name"]: _ALWAYS})])
        return NEVER

    def _set_operation(self, node: dict[str, Any], scope: _Scope) -> Condition:
        sides = node.get("children") or [node["left"], node["right"]]
        conditions = [self.node(side, scope) for side in sides]
        kind = node["setop_type"]
        if kind.startswith("UNION"):
            return _all(conditions)
        if kind.startswith("INTERSECT"):
            return _any(conditions)
        return conditions[0] if kind.startswith("EXCEPT") else NEVER

    def _select(self, node: dict[str, Any], scope: _Scope) -> Condition:
        if not all(node["group_sets"]):  # a group of everything, also of nothing
            return NEVER
        is_of_all = not node["group_sets"] and not _wants_rows(node["having"])
        if is_of_all and self._may_aggregate([node.get(key) for key in _AGGREGATING]):
            return NEVER
        where = node["where_clause"]
        refused = NEVER if where is None else self._refuses(where, scope)
        return _any([self._table(node["from_table"], scope), refused])

    def _refuses(self, where: dict[str, Any], scope: _Scope) -> Condition:
        """Return when no row fulfils a WHERE."""
        if where["class"] == "CONJUNCTION":
            parts = [self._refuses(part, scope) for part in where["children"]]
            return _any(parts) if where["type"] == "CONJUNCTION_AND" else _all(parts)
        if where["class"] == "SUBQUERY" and where["subquery_type"] in ("ANY", "EXISTS"):
            return self.node(where["subquery"]["node"], scope)
        return NEVER

    def _table(self, table: dict[str, Any], scope: _Scope) -> Condition:
        kind = table["type"]
        if kind == "BASE_TABLE":
            return self._named(".".join(table["qualified_name"]["path"]), scope)
        if kind == "SUBQUERY":
            return self.node(table["subquery"]["node"], scope)
        if kind == "JOIN":
            return self._join(table, scope)
        if kind == "TABLE_FUNCTION":
            return self._function(table["function"], scope)
        return NEVER

    def _named(self, name: str, scope: _Scope) -> Condition:
        found: Condition = scope.get(name, name)
        return found

    def _join(self, table: dict[str, Any], scope: _Scope) -> Condition:
        left, right = self._table(table["left"], scope), self._table(table["right"], scope)
        kind = "FULL" if table["ref_type"] == "POSITIONAL" else table["join_type"]
        if kind in ("INNER", "SEMI"):
            return _any([left, right])
        if kind in _LEFT:
            return left
        return right if kind == "RIGHT" else _all([left, right])

    def _function(self, function: dict[str, Any], scope: _Scope) -> Condition:
        name = ".".join(function["qualified_name"]["path"])
        arguments = function["arguments"]
        given = [_text(argument["expression"], scope) for argument in arguments]
        if name == "query_table" and len(given) == 1 and given[0] is not None:
            return self._named(given[0], scope)
        if name not in self._macros:
            return NEVER
        if not any(given):
            return name
        called = self._macros[name]
        outside = {key: value for key, value in scope.items() if not key.startswith("$")}
        params = [
            argument["name"] or param
            for argument, param in zip(arguments, called.params, strict=False)
        ]
        texts = {f"${param}": text for param, text in zip(params, given, strict=False)}
        return self.node(called.node, outside | texts)

    def _may_aggregate(self, tree: Any) -> bool:
        """Tell whether something in an expression makes one row of all."""
        if isinstance(tree, list):
            return any(map(self._may_aggregate, tree))
        if not isinstance(tree, dict) or tree.get("class") == "SUBQUERY":
            return False
        if tree.get("class") == "FUNCTION" and not self._is_scalar(tree):
            return True
        # The function of a window gives each row a value.
        return any(map(self._may_aggregate, tree.values()))

    def _is_scalar(self, function: dict[str, Any]) -> bool:
        name = ".".join(function["qualified_name"]["path"])
        called = self._macros.get(name)
        if called is None:
            return name in self._scalar
        return called.is_scalar and not self._may_aggregate(called.node["select_list"])


def _wants_rows(having: dict[str, Any] | None) -> bool:
    """Tell whether a HAVING is `count(…) > 0`, or that and more, which nothing fulfils."""
    if having is None:
        return False
    if having["type"] == "CONJUNCTION_AND":
        return any(map(_wants_rows, having["children"]))
    return (
        having["type"] == "COMPARE_GREATERTHAN"
        and having["left"].get("function_name") in ("count_star", "count")
        and having["right"].get("literal", {}).get("text", "").isdigit()
    )


def _text(expression: dict[str, Any], scope: _Scope) -> str | None:
    """Return the text that an argument is, None if it is none or not known."""
    if expression["class"] == "CONSTANT":
        literal = expression["literal"]
        return literal["text"] if literal["kind"] == "STRING" else None
    if expression["class"] == "COLUMN_REF":
        return scope.get(f"${expression['column_names'][-1]}")
    if expression["class"] == "FUNCTION" and expression["function_name"] == "||":
        texts = [_text(part["expression"], scope) for part in expression["arguments"]]
        return None if None in texts else "".join(text or "" for text in texts)
    return None
