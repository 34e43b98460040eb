-- title: What changed around a moment
-- description: What changed within a second of it, what pauses then, and the last change before it
--     of anything else, which still holds.
-- grain: one row per change
-- reads: change, change_named
-- param: at_ns BIGINT  The moment, epoch ns
-- param: run_start_ns BIGINT  Begin of the run, epoch ns
-- column: at_ns BIGINT [epoch ns]  When
-- column: kind VARCHAR  As in query changes
-- column: what VARCHAR  Likewise
-- column: node VARCHAR  Node
-- column: subject VARCHAR  Likewise
-- column: change VARCHAR  Likewise
-- column: since VARCHAR  Likewise
-- column: follows VARCHAR  Likewise
-- column: headline VARCHAR  All of it, as people say it
WITH held AS (
    SELECT
        c.at_ns, c.kind, c.what, c.node, c.subject, c.change, c.since, c.follows,
        c.meanwhile_callback, c.meanwhile_node, n.times,
        abs(c.at_ns - $at_ns) <= 1_000_000_000 AS is_near,
        row_number() OVER (PARTITION BY c.what, c.node, c.subject ORDER BY c.at_ns DESC) AS place
    FROM change AS c
    JOIN change_named AS n
        ON c.at_ns = n.at_ns AND c.kind = n.kind AND c.what = n.what AND c.subject = n.subject
        AND c.node IS NOT DISTINCT FROM n.node
    WHERE c.at_ns <= $at_ns + 1_000_000_000
)
SELECT
    at_ns, kind, what, node, subject, change, since, follows,
    printf(
        '%s%s%s: %s', coalesce(node || ': ', ''),
        CASE WHEN what <> 'timer' THEN what || ' of ' ELSE '' END,
        subject,
        CASE kind
            WHEN 'step' THEN change || printf(' since %.1f s', (at_ns - $run_start_ns) / 1e9)
            WHEN 'stop' THEN printf('none since %.1f s', (at_ns - $run_start_ns) / 1e9)
            WHEN 'trend' THEN change || ' during the run'
            ELSE kind || ' of ' || change
        END
    )
    || coalesce(printf('; %s of %s runs meanwhile', meanwhile_callback, meanwhile_node), '')
    || coalesce('; ' || since || ' then', '') AS headline
FROM held
WHERE is_near
    OR (place = 1 AND kind IN ('step', 'stop', 'trend'))
    OR len(
        list_filter(
            times,
            lambda ends: ends[1] <= $at_ns + 1_000_000_000 AND ends[2] >= $at_ns - 1_000_000_000
        )
    ) > 0
ORDER BY NOT is_near, follows IS NOT NULL, abs(at_ns - $at_ns), what, node, subject
