-- title: What the changes of paths consist of
-- description: The difference of the means of a path (`compared`: rows of `main.comparison`) is the
--     sum of the differences of its parts (`part_a` and `part_b`: rows of `path-breakdown`): the
--     time of all flows in a part, by the number of flows. What only one run has took no time in
--     the other one. Where the kernel was traced in both, the time of a callback is divided as that
--     of all its instances is (`state_a` and `state_b`).
-- grain: one row per path that both runs have, and part of it at a node; one more for each path,
--     with all of it
-- reads: compared, part_a, part_b, state_a, state_b
-- column: difference_ns BIGINT [ns]  Mean of B less mean of A
-- column: share DOUBLE [share]  Part of the difference of the path
-- column: node VARCHAR [node]  Node, or 'between nodes'; NULL: all of the path
-- column: part VARCHAR  As in `path-breakdown`; of a callback where the kernel was traced 'running'
--     (on a CPU), 'run_queue' (waiting for one) and 'sleeping'; 'all': the path
-- column: what VARCHAR  Callback, or topic of the message
-- column: a_mean_ns BIGINT [ns]  How long it took in run A, per flow
-- column: b_mean_ns BIGINT [ns]  The same in run B
-- column: path
-- brief: path, difference_ns, share, node, part, what, a_mean_ns, b_mean_ns
WITH state AS (
    UNPIVOT (
        SELECT
            'a' AS side,
            *
        FROM state_a
        UNION ALL
        SELECT 'b', *
        FROM state_b
    )
    ON running, run_queue, sleeping INTO NAME state VALUE state_ns
),
spent AS (
    SELECT
        side, node, what, state,
        state_ns / sum(state_ns) OVER (PARTITION BY side, node, what) AS share
    FROM state
    QUALIFY sum(state_ns) OVER (PARTITION BY side, node, what) > 0
),
both_sides AS (
    SELECT
        p.side, p.path, p.node,
        coalesce(s.state, p.part) AS part,
        p.what,
        p.total_ns * coalesce(s.share, 1) AS total_ns
    FROM (
        SELECT
            'a' AS side,
            path, node, part, what, total_ns
        FROM part_a
        UNION ALL
        SELECT 'b', path, node, part, what, total_ns
        FROM part_b
    ) AS p
    -- A part that only one of them can tell would look like a change.
    LEFT JOIN (FROM spent QUALIFY count(DISTINCT side) OVER (PARTITION BY node, what) = 2) AS s
        ON p.side = s.side AND p.node = s.node AND p.what = s.what AND p.part = 'callback'
),
part AS (
    SELECT
        s.path, s.node, s.part, s.what,
        coalesce(sum(s.total_ns) FILTER (WHERE s.side = 'a') / any_value(c.a_count), 0) AS a_ns,
        coalesce(sum(s.total_ns) FILTER (WHERE s.side = 'b') / any_value(c.b_count), 0) AS b_ns
    FROM both_sides AS s
    JOIN compared AS c ON s.path = c.subject
    WHERE c.statistic = 'mean' AND c.a_count > 0 AND c.b_count > 0
    GROUP BY s.path, s.node, s.part, s.what
),
whole AS (
    SELECT
        path,
        sum(a_ns) AS a_ns,
        sum(b_ns) AS b_ns
    FROM part
    GROUP BY path
),
every AS (
    SELECT
        path,
        NULL AS node,
        'all' AS part,
        NULL AS what,
        a_ns, b_ns
    FROM whole
    UNION ALL
    SELECT path, node, part, what, a_ns, b_ns
    FROM part
    WHERE a_ns <> 0 OR b_ns <> 0
)
SELECT
    round(e.b_ns - e.a_ns)::BIGINT AS difference_ns,
    round((e.b_ns - e.a_ns) / nullif(w.b_ns - w.a_ns, 0), 4) AS share,
    e.node, e.part, e.what,
    round(e.a_ns)::BIGINT AS a_mean_ns,
    round(e.b_ns)::BIGINT AS b_mean_ns,
    e.path
FROM every AS e
JOIN whole AS w ON e.path = w.path
ORDER BY
    abs(w.b_ns - w.a_ns) DESC, e.path, e.part <> 'all', abs(e.b_ns - e.a_ns) DESC, e.node, e.part,
    e.what
