-- title: End-to-end latency by path, of many runs
-- description: As the query e2e-latency says it of one run, exactly: computed from the flows of all
--     runs. Paths of one text are one path.
-- grain: one row per path and group of runs
-- param: case
-- column: label_group
-- column: runs BIGINT              Runs that have the path
-- column: roots BIGINT             Flows that began
-- column: reached, superseded, dropped, lost, no_output, not_connected, unknown, cut_by_recording,
--     loss_affected, ambiguous, pairs, stored, looped, min_ns, median_ns, mean_ns, p95_ns, p99_ns,
--     max_ns
-- column: sink_event VARCHAR       Events that stopped the clock
-- column: is_cut BOOLEAN           The path goes on or has siblings beyond the limits of the query
-- column: reasons, path
-- brief: path, median_ns, p95_ns, max_ns, runs, reached, roots, dropped, lost,
--     ambiguous, superseded, no_output, p99_ns, not_connected, unknown, cut_by_recording, reasons,
--     mean_ns, min_ns, loss_affected, pairs, stored
WITH arrival AS MATERIALIZED (
    SELECT
        g.label_group, f.run, f.path, f.path_id, f.root_kind, f.root_id, f.latency_ns,
        f.sink_event, f.status, f.reason, f.is_first, f.is_loss_affected, f.is_ambiguous,
        CASE $case
            WHEN 'first' THEN f.is_first
            WHEN 'last' THEN f.is_last
            WHEN 'newest' THEN f.is_newest
            ELSE true
        END AS is_counted
    FROM flow AS f
    JOIN run_group AS g ON f.run = g.run
),
completeness AS (
    SELECT
        label_group, path,
        count(*) FILTER (is_first IS NOT false) AS roots,
        histogram(status) FILTER (is_first IS NOT false)::MAP(VARCHAR, BIGINT) AS number,
        count(DISTINCT (run, path_id, root_kind, root_id)) FILTER (is_loss_affected)
            AS loss_affected
    FROM arrival
    GROUP BY label_group, path
),
reason AS (
    SELECT
        label_group, path,
        map(
            list(reason ORDER BY number DESC, reason), list(number ORDER BY number DESC, reason)
        ) AS reasons
    FROM (
        SELECT label_group, path, reason, count(*) AS number
        FROM arrival
        WHERE status <> 'reached'
        GROUP BY label_group, path, reason
    )
    GROUP BY label_group, path
),
latency AS (
    SELECT
        label_group, path,
        count(*) FILTER (WHERE is_ambiguous) AS ambiguous,
        count(latency_ns) AS pairs,
        count(*) - count(latency_ns) AS stored,
        string_agg(DISTINCT sink_event, ', ' ORDER BY sink_event) AS sink_event,
        min(latency_ns) AS min_ns,
        quantile_disc(latency_ns, [0.5, 0.95, 0.99]) AS quantiles,
        round(avg(latency_ns))::BIGINT AS mean_ns,
        max(latency_ns) AS max_ns
    FROM arrival
    WHERE status = 'reached' AND is_counted
    GROUP BY label_group, path
),
known AS (
    SELECT
        g.label_group, e.path,
        count(DISTINCT e.run) AS runs,
        sum(e.looped)::BIGINT AS looped,
        bool_or(e.is_cut) AS is_cut
    FROM e2e_latency AS e
    JOIN run_group AS g ON e.run = g.run
    GROUP BY g.label_group, e.path
)
SELECT
    k.label_group, k.runs,
    coalesce(c.roots, 0) AS roots,
    coalesce(c.number['reached'], 0) AS reached,
    coalesce(c.number['superseded'], 0) AS superseded,
    coalesce(c.number['dropped'], 0) AS dropped,
    coalesce(c.number['lost'], 0) AS lost,
    coalesce(c.number['no_output'], 0) AS no_output,
    coalesce(c.number['not_connected'], 0) AS not_connected,
    coalesce(c.number['unknown'], 0) AS unknown,
    coalesce(c.number['cut_by_recording'], 0) AS cut_by_recording,
    coalesce(COLUMNS(['loss_affected', 'ambiguous', 'pairs', 'stored']), 0),
    k.looped, l.min_ns,
    l.quantiles[1] AS median_ns,
    l.mean_ns,
    l.quantiles[2] AS p95_ns,
    l.quantiles[3] AS p99_ns,
    l.max_ns, l.sink_event, k.is_cut, r.reasons, k.path
FROM known AS k
LEFT JOIN completeness AS c ON k.label_group = c.label_group AND k.path = c.path
LEFT JOIN latency AS l ON k.label_group = l.label_group AND k.path = l.path
LEFT JOIN reason AS r ON k.label_group = r.label_group AND k.path = r.path
ORDER BY k.path, k.label_group
