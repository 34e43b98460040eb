-- title: What callbacks take of their threads
-- description: How long callbacks run and how often. Those of one node that the same thing triggers
--     are one, also if the node was started again. The steps of a coroutine are one instance,
--     without the time for which it awaits. What a node takes longer for right after it was started
--     again belongs to that.
-- grain: one row per node and callback
-- reads: callback_name, node_restart, noticed
-- column: node VARCHAR  Node
-- column: callback VARCHAR  What triggers it
-- column: function VARCHAR  Its function, without its module; NULL: not known
-- column: first_ns BIGINT [epoch ns]  When it ran first
-- column: last_ns BIGINT [epoch ns]  When it ran last
-- column: instances BIGINT  How often it ran
-- column: usual_ns BIGINT [ns]  Median duration
-- column: mean_ns
-- column: run_ns BIGINT [ns]  95 % of its instances took no longer
-- column: long_instances BIGINT  Those that took much longer than usual; NULL: none, or what is
--     usual is too long
-- column: long_ns BIGINT [ns]  Their median duration
-- column: longer_ns BIGINT [ns]  What they took longer than; 0: there are none, all count
-- column: period_ns BIGINT [ns]  Mean time from one start to the next; NULL: it ran once
-- column: limit_ns BIGINT [ns]  Delay of it that an engineer notices
WITH instance AS (
    SELECT
        n.node, n.callback,
        any_value(n.function) AS function,
        min(i.start_ns) AS start_ns,
        sum(i.end_ns - i.start_ns)::BIGINT AS run_ns
    FROM main.callback_instance AS i
    JOIN callback_name AS n ON i.callback_id = n.callback_id
    CROSS JOIN noticed AS l
    LEFT JOIN node_restart AS r ON n.node = r.node
    WHERE list_contains($runs, i.run_id)
        AND i.start_ns >= $start_ns AND i.start_ns < $end_ns
        AND i.end_ns IS NOT NULL
        AND coalesce(i.start_ns NOT BETWEEN r.begun_ns AND r.begun_ns + l.start_ns, true)
    GROUP BY coalesce(i.continues_id, i.callback_instance_id), n.node, n.callback
),
callback AS (
    SELECT
        node, callback,
        any_value(function) AS function,
        min(start_ns) AS first_ns,
        max(start_ns) AS last_ns,
        count(*) AS instances,
        quantile_disc(run_ns, [0.5, 0.95]) AS quantiles,
        avg(run_ns)::BIGINT AS mean_ns
    FROM instance
    GROUP BY node, callback
),
limited AS (
    SELECT
        c.*,
        (c.last_ns - c.first_ns) // nullif(c.instances - 1, 0) AS period_ns,
        greatest(n.least_ns, least(n.late_ns, n.of_period * period_ns))::BIGINT AS limit_ns
    FROM callback AS c
    CROSS JOIN noticed AS n
),
-- At least half as long as those that are to blame for half of the time that is more than three
-- times the usual.
longest AS (
    SELECT
        node, callback,
        max(run_ns) FILTER (WHERE 2 * longer_ns >= all_ns) // 2 AS longer_ns
    FROM (
        SELECT
            i.node, i.callback, i.run_ns,
            sum(i.run_ns) OVER (
                PARTITION BY i.node, i.callback ORDER BY i.run_ns DESC
            ) AS longer_ns,
            sum(i.run_ns) OVER (PARTITION BY i.node, i.callback) AS all_ns
        FROM instance AS i
        JOIN callback AS u ON i.node = u.node AND i.callback = u.callback
        WHERE i.run_ns > 3 * u.quantiles[1]
    )
    GROUP BY node, callback
    HAVING count(*) >= 3
)
SELECT
    c.node, c.callback, c.function, c.first_ns, c.last_ns, c.instances,
    c.quantiles[1] AS usual_ns,
    c.mean_ns,
    c.quantiles[2] AS run_ns,
    l.long_instances, l.long_ns,
    coalesce(l.longer_ns, 0) AS longer_ns,
    c.period_ns, c.limit_ns
FROM limited AS c
LEFT JOIN (
    SELECT
        i.node, i.callback, l.longer_ns,
        quantile_disc(i.run_ns, 0.5) AS long_ns,
        count(*) AS long_instances
    FROM instance AS i
    JOIN longest AS l ON i.node = l.node AND i.callback = l.callback
    WHERE i.run_ns > l.longer_ns
    GROUP BY i.node, i.callback, l.longer_ns
) AS l
    ON c.node = l.node AND c.callback = l.callback AND c.quantiles[1] < c.limit_ns
