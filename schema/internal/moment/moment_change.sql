-- title: What changed around a moment
-- description: What changed within a second of it, what pauses then, and the last change before it
--     of anything else, which still holds.
-- grain: one row per change
-- reads: change, change_named
-- param: at_ns BIGINT  The moment, epoch ns
-- column: at_ns BIGINT [epoch ns]  When
-- column: kind VARCHAR  As in query changes
-- column: what VARCHAR  Likewise
-- column: node VARCHAR  Node
-- column: subject VARCHAR  Likewise
-- column: change VARCHAR  Likewise
-- column: since VARCHAR  Likewise
-- column: follows VARCHAR  Likewise
-- column: headline VARCHAR  All of it, in words
SELECT
    c.at_ns, c.kind, c.what, c.node, c.subject, c.change, c.since, c.follows,
    c.sentence AS headline
FROM change AS c
JOIN change_named AS n ON c.change_id = n.change_id
WHERE c.at_ns <= $at_ns + 1_000_000_000
QUALIFY c.at_ns >= $at_ns - 1_000_000_000
    OR len(
        list_filter(
            n.times,
            lambda ends: ends[1] <= $at_ns + 1_000_000_000 AND ends[2] >= $at_ns - 1_000_000_000
        )
    ) > 0
    OR (
        c.kind IN ('step', 'stop', 'trend')
        AND row_number() OVER (PARTITION BY n.what, n.series_id ORDER BY c.at_ns DESC) = 1
    )
ORDER BY
    c.at_ns < $at_ns - 1_000_000_000, c.follows_id IS NOT NULL, abs(c.at_ns - $at_ns), c.what,
    c.node, c.subject
