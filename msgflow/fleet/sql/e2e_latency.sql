-- title: End-to-end latency by path, of many runs
-- description: As the query e2e-latency says it of one run, exactly: computed from the flows of all
--     runs. Paths of one text are one path.
-- grain: one row per path and group of runs
-- param: case
-- column: label_group
-- column: runs BIGINT              Runs that have the path
-- column: roots BIGINT             Flows that began
-- column: reached, superseded, dropped, lost, no_output, not_connected, unknown, cut_by_recording,
--     loss_affected, ambiguous, pairs, stored, looped
-- column: min_ns, median_ns, mean_ns, p95_ns, p99_ns, max_ns
-- column: sink_event VARCHAR       Events that stopped the clock
-- column: is_cut BOOLEAN           The path goes on or has siblings beyond the limits of the query
-- column: reasons, path
-- brief: path, median_ns, p95_ns, max_ns, runs, reached, roots, dropped, lost,
--     ambiguous, superseded, no_output, p99_ns, not_connected, unknown, cut_by_recording, reasons,
--     mean_ns, min_ns, loss_affected, pairs, stored
WITH known AS (
    SELECT
        label_group, path,
        count(DISTINCT run) AS runs,
        sum(COLUMNS([
            'roots', 'reached', 'superseded', 'dropped', 'lost', 'no_output', 'not_connected',
            'unknown', 'cut_by_recording', 'loss_affected', 'looped'
        ]))::BIGINT,
        bool_or(is_cut) AS is_cut
    FROM e2e_latency
    GROUP BY label_group, path
),
-- Of other arrivals than those that a run counts by default, and quantiles of all flows together.
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
    FROM flow
    WHERE status = 'reached'
        AND CASE $case
            WHEN 'first' THEN is_first
            WHEN 'last' THEN is_last
            WHEN 'newest' THEN is_newest
            ELSE true
        END
    GROUP BY label_group, path
),
reason AS (
    SELECT
        label_group, path,
        map(
            list(reason ORDER BY number DESC, reason), list(number ORDER BY number DESC, reason)
        ) AS reasons
    FROM (
        SELECT
            label_group, path, reason,
            count(*) AS number
        FROM flow
        WHERE status <> 'reached'
        GROUP BY label_group, path, reason
    )
    GROUP BY label_group, path
)
SELECT
    k.label_group, k.runs, k.roots, k.reached, k.superseded, k.dropped, k.lost, k.no_output,
    k.not_connected, k.unknown, k.cut_by_recording, k.loss_affected,
    coalesce(COLUMNS(['ambiguous', 'pairs', 'stored']), 0),
    k.looped, l.min_ns,
    l.quantiles[1] AS median_ns,
    l.mean_ns,
    l.quantiles[2] AS p95_ns,
    l.quantiles[3] AS p99_ns,
    l.max_ns, l.sink_event, k.is_cut, r.reasons, k.path
FROM known AS k
LEFT JOIN latency AS l ON k.label_group = l.label_group AND k.path = l.path
LEFT JOIN reason AS r ON k.label_group = r.label_group AND k.path = r.path
ORDER BY k.path, k.label_group
