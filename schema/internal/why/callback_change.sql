-- title: Callbacks that take longer than before
-- description: Since a moment, for a while, or more and more. Of several changes the largest.
-- grain: one row per node and callback
-- reads: change
-- column: node VARCHAR  Node of the callback
-- column: callback VARCHAR  What triggers it
-- column: is_trend BOOLEAN  It grows all through the run; else it changed at one moment
-- column: since_ns BIGINT [ns]  When, since the start of the run
-- column: until_ns BIGINT [ns]  When it changed again; NULL: it did not
-- column: before_ns BIGINT [ns]  Its duration before
-- column: after_ns BIGINT [ns]  And after
-- column: occasion VARCHAR  What began within the same second; NULL: nothing that is known
SELECT
    c.node,
    c.subject AS callback,
    c.kind = 'trend' AS is_trend,
    c.at_ns - r.start_ns AS since_ns,
    lead(c.at_ns) OVER (PARTITION BY c.node, c.subject ORDER BY c.at_ns) - r.start_ns AS until_ns,
    c.before::BIGINT AS before_ns,
    c.after::BIGINT AS after_ns,
    c.since AS occasion
FROM change AS c
JOIN main.run AS r ON c.run_id = r.run_id
WHERE c.what = 'duration' AND c.kind IN ('step', 'trend')
QUALIFY row_number() OVER (
    PARTITION BY c.node, c.subject ORDER BY c.after - c.before DESC, c.at_ns
) = 1
    AND c.after > c.before
