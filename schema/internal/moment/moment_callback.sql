-- title: What ran around a moment
-- description: The callbacks that took most of the second around it.
-- grain: one row per node and callback
-- param: at_ns BIGINT  The moment, epoch ns
-- column: node VARCHAR  Node
-- column: callback VARCHAR  What triggers it
-- column: count BIGINT  Instances in the second
-- column: longest_ns BIGINT [ns]  The longest of them; without an end, until the second ends
-- column: usual_ns BIGINT [ns]  Median of all its instances
-- column: share DOUBLE [share]  Of the second for which it ran
-- column: then VARCHAR  'runs' at the moment itself; 'has no end': it did not come back
WITH instance AS (
    SELECT
        l.node,
        l.label AS callback,
        i.start_ns, i.end_ns,
        coalesce(i.end_ns, $at_ns + 500_000_000) AS until_ns
    FROM main.callback_instance AS i
    JOIN main.callback_label AS l ON i.callback_id = l.callback_id
    WHERE list_contains($runs, i.run_id) AND NOT l.is_internal
        AND (
            i.end_ns IS NOT NULL
            OR i.callback_instance_id IN (
                SELECT callback_instance_id FROM derive.hanging_callback
            )
        )
),
usual AS (
    SELECT
        node, callback,
        median(end_ns - start_ns)::BIGINT AS usual_ns
    FROM instance
    GROUP BY node, callback
)
SELECT
    i.node, i.callback,
    count(*) AS count,
    max(i.until_ns - i.start_ns) AS longest_ns,
    any_value(u.usual_ns) AS usual_ns,
    sum(
        least(i.until_ns, $at_ns + 500_000_000) - greatest(i.start_ns, $at_ns - 500_000_000)
    ) / 1e9 AS share,
    CASE
        WHEN bool_or(i.end_ns IS NULL) THEN 'has no end'
        WHEN bool_or(i.start_ns <= $at_ns AND i.end_ns > $at_ns) THEN 'runs'
    END AS "then"
FROM instance AS i
JOIN usual AS u ON i.node = u.node AND i.callback = u.callback
WHERE i.start_ns < $at_ns + 500_000_000 AND i.until_ns > $at_ns - 500_000_000
GROUP BY i.node, i.callback
ORDER BY share DESC, i.node, i.callback
LIMIT 8
