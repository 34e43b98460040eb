-- description: What a good run met, and a little more, as requirements. It reads the rows of named
--     queries, each a table of its name, in the order of `place`.
-- grain: one row per thing with requirements
-- reads: action_latency, e2e_latency, scheduling, scheduling_wakeup, service_latency, timers,
--     topics_rate
-- param: margin DOUBLE  How much more than measured is allowed, as a share
-- param: least_values BIGINT  With fewer values, a percentile is only their largest
WITH path AS (
    SELECT
        steps[2] AS first,
        steps[-2] AS last,
        min(place) AS place,
        max(p99_ns) AS slow_ns,
        min(reached / (roots - not_connected - cut_by_recording)) AS share
    FROM (
        SELECT
            *,
            string_split(path, ' → ') AS steps
        FROM e2e_latency
    )
    -- A service that is called has brackets.
    WHERE steps[2] LIKE '/%' AND steps[-2] LIKE '/%' AND steps[2] <> steps[-2]
    GROUP BY ALL
    HAVING min(pairs) >= $least_values
),
timer AS (
    SELECT
        node, callback,
        min(place) AS place,
        min(rate_hz) AS least_hz,
        max(rate_hz) AS most_hz,
        -- The time that an operating system may need to wake a thread.
        greatest(1e6, max(lateness_p99_ns)) AS late_ns,
        bool_and(lateness_p99_ns IS NOT NULL) AS is_late_known
    FROM timers
    GROUP BY ALL
    HAVING min(count) >= $least_values
),
callback AS (
    SELECT
        node, callback,
        min(place) AS place,
        max(running_p99_ns) AS slow_ns,
        1 + floor(
            100 * (1 + $margin) * coalesce(max(preempted_ns / nullif(total_ns, 0)), 0)
        )::BIGINT AS most_percent
    FROM scheduling
    WHERE node LIKE '/%'
    GROUP BY ALL
    HAVING min(count) >= $least_values
),
topic AS (
    SELECT
        topic_name, publisher,
        min(place) AS place,
        any_value(rate_hz) AS rate_hz
    FROM topics_rate
    WHERE topic_name IS NOT NULL AND publisher LIKE '/%'
    GROUP BY ALL
    -- A topic that pauses or comes in bursts has no rate.
    HAVING count(*) = 1 AND min(count) >= $least_values
        AND any_value(period_deviation_ns) * any_value(rate_hz) <= 0.25 * 1e9
),
called AS (
    SELECT
        kind, name,
        min(place) AS place,
        max(slow_ns) AS slow_ns,
        if(kind = 'service', 'round_trip', 'goal') AS metric
    FROM (
        SELECT
            'service' AS kind,
            service_name AS name,
            place,
            answered AS samples,
            round_trip_p99_ns AS slow_ns
        FROM service_latency
        UNION ALL
        SELECT 'action', action_name, place, finished, result_p99_ns FROM action_latency
    )
    -- The services of an action say no more than the action.
    WHERE NOT contains(name, '/_action/')
    GROUP BY ALL
    HAVING min(samples) >= $least_values
),
process AS (
    SELECT
        nodes, process,
        min(place) AS place,
        max(p99_ns) AS slow_ns,
        -- Without nodes it has its id, which is another one in the next run.
        if(nodes LIKE '/%', nodes, process) AS name
    FROM scheduling_wakeup
    GROUP BY ALL
    HAVING max(count) >= $least_values
),
-- A time is allowed to be a little longer, and has its unit; else there is a text already.
required (number, place, kind, names, field, metric, most_ns, condition) AS (
    SELECT
        10, place, 'path',
        [first, last],
        NULL, 'latency', slow_ns, NULL
    FROM path
    UNION ALL
    SELECT
        11, place, 'path',
        [first, last],
        NULL, 'completeness', NULL,
        printf('>= %d %%', floor(100 * share * (1 - $margin / 10))::BIGINT)
    FROM path
    UNION ALL
    SELECT
        20, place, 'timer',
        [node, callback],
        'callback', 'rate', NULL,
        printf('%.4g Hz ± 5 %%', (most_hz + least_hz) / 2)
    FROM timer
    WHERE most_hz - least_hz <= 0.1 * least_hz
    UNION ALL
    SELECT
        21, place, 'timer',
        [node, callback],
        'callback', 'lateness', late_ns, NULL
    FROM timer
    WHERE is_late_known
    UNION ALL
    SELECT
        30, place, 'callback',
        [callback, node],
        'node', 'cpu', slow_ns, NULL
    FROM callback
    UNION ALL
    SELECT
        31, place, 'callback',
        [callback, node],
        'node', 'preempted', NULL,
        printf('< %d %%', most_percent)
    FROM callback
    WHERE most_percent < 100
    UNION ALL
    SELECT
        40, place, 'topic',
        [topic_name, publisher],
        'node', 'rate', NULL,
        printf('%.4g Hz ± 5 %%', rate_hz)
    FROM topic
    UNION ALL
    SELECT
        if(kind = 'service', 50, 60),
        place, kind,
        [name],
        NULL, metric, slow_ns, NULL
    FROM called
    UNION ALL
    SELECT
        70, place, 'process',
        [name],
        NULL, 'wakeup', slow_ns, NULL
    FROM process
    WHERE name <> ''
),
-- Rounded up to two digits.
rounded AS (
    SELECT
        *,
        list_last(list_filter([1, 1e3, 1e6, 1e9], lambda each: each <= allowed_ns)) AS unit_ns,
        pow(10, floor(log10(allowed_ns / unit_ns)) - 1) AS step
    FROM (
        SELECT
            *,
            greatest(1, most_ns * (1 + $margin)) + 1 AS allowed_ns
        FROM required
    )
)
SELECT
    kind, names, field,
    list(metric ORDER BY number) AS metrics,
    list(coalesce(condition, printf(
        'p99 < %.6g %s', ceil(allowed_ns / unit_ns / step) * step,
        CASE unit_ns WHEN 1 THEN 'ns' WHEN 1e3 THEN 'us' WHEN 1e6 THEN 'ms' ELSE 's' END
    )) ORDER BY number) AS conditions
FROM rounded
GROUP BY number // 10, place, kind, names, field
ORDER BY number // 10, place
