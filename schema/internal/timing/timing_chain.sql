-- title: Timing of chains
-- description: The paths of a run, with the callbacks that their messages lead to, and how long
--     these take together at most, without the ways of messages and the first callback.
-- grain: one row per path
-- reads: paths, timing_callback
-- column: path VARCHAR [path]  The path
-- column: callbacks VARCHAR[]  Callbacks that messages lead to, in order
-- column: median_ns, p95_ns, max_ns
-- column: bound_ns BIGINT [ns]  Sum of their bounds; NULL: one has none that holds
WITH hop AS (
    SELECT
        path_id, path,
        generate_subscripts(subscriptions, 1) AS hop,
        unnest(subscriptions) AS subscription_id
    FROM main.flow_path($runs)
    WHERE is_path
),
chain AS (
    SELECT
        h.path,
        list(t.node || ' ' || t.callback ORDER BY h.hop) AS callbacks,
        CASE WHEN bool_and(coalesce(t.is_sure, false)) THEN sum(t.bound_ns) END::BIGINT AS bound_ns
    FROM hop AS h
    LEFT JOIN main.callback AS c ON h.subscription_id = c.subscription_id
    LEFT JOIN timing_callback AS t ON c.callback_id = t.callback_id
    GROUP BY h.path_id, h.path
)
SELECT
    p.path,
    arg_max(c.callbacks, coalesce(c.bound_ns, 0)) AS callbacks,
    any_value(p.median_ns) AS median_ns,
    any_value(p.p95_ns) AS p95_ns,
    any_value(p.max_ns) AS max_ns,
    CASE WHEN count(*) = count(c.bound_ns) THEN max(c.bound_ns) END AS bound_ns
FROM paths AS p
JOIN chain AS c ON p.path = c.path
GROUP BY p.path
ORDER BY p.path
