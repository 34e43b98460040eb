-- title: What is to blame in one run, and not as much in the other
-- description: Culprits of two runs, rows of the verdicts of `why` (`culprit_a`, `culprit_b`).
--     Those of one kind, node and callback are the same one.
-- grain: one row per kind, node and callback, the greatest change first
-- reads: culprit_a, culprit_b
-- param: at_least
-- column: change VARCHAR  'new' (only in B), 'gone' (only in A), 'more' or 'less' harm, or 'alike'
-- column: kind VARCHAR  What it does, as `why` says
-- column: node VARCHAR [node]  Node
-- column: callback VARCHAR  What triggers its callback; NULL: not one callback
-- column: function VARCHAR  Function of the callback; NULL: not known
-- column: a_harm_ns BIGINT [ns]  Mean time by which data are older because of it in run A
-- column: b_harm_ns BIGINT [ns]  The same in run B
-- column: path VARCHAR [path]  Path that it delays most
-- column: headline VARCHAR  What `why` says of it, of B where it is there
WITH culprit AS (
    SELECT
        side, kind, node, callback,
        any_value(function) AS function,
        sum(harm_ns)::BIGINT AS harm_ns,
        arg_max(path, harm_ns) AS path,
        arg_max(headline, harm_ns) AS headline
    FROM (
        SELECT
            'a' AS side,
            kind, node, callback, function, harm_ns, path, headline
        FROM culprit_a
        UNION ALL
        SELECT 'b', kind, node, callback, function, harm_ns, path, headline
        FROM culprit_b
    )
    WHERE kind IS NOT NULL
    GROUP BY side, kind, node, callback
)
SELECT
    CASE
        WHEN a.kind IS NULL THEN 'new'
        WHEN b.kind IS NULL THEN 'gone'
        WHEN abs(b.harm_ns - a.harm_ns) <= $at_least * a.harm_ns THEN 'alike'
        WHEN b.harm_ns > a.harm_ns THEN 'more'
        ELSE 'less'
    END AS change,
    coalesce(b.kind, a.kind) AS kind,
    coalesce(b.node, a.node) AS node,
    coalesce(b.callback, a.callback) AS callback,
    coalesce(b.function, a.function) AS function,
    a.harm_ns AS a_harm_ns,
    b.harm_ns AS b_harm_ns,
    coalesce(b.path, a.path) AS path,
    coalesce(b.headline, a.headline) AS headline
FROM (FROM culprit WHERE side = 'a') AS a
FULL JOIN (FROM culprit WHERE side = 'b') AS b
    ON a.kind = b.kind
    AND a.node IS NOT DISTINCT FROM b.node
    AND a.callback IS NOT DISTINCT FROM b.callback
ORDER BY
    change = 'alike',
    abs(coalesce(b.harm_ns, 0) - coalesce(a.harm_ns, 0)) DESC,
    kind, node, callback
