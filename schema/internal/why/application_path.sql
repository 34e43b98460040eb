-- title: Paths of the application
-- description: The paths that an explanation may blame. Those with heartbeats
--     (derive.heartbeat_topic) are not among them, unless there is nothing else or the caller asks
--     for a place. How old the data at the end of a path are counts from each root to the first
--     arrival of it or of a newer one: a message that is lost costs the time until the next one,
--     unless a reader is not there by then.
-- grain: one row per printed path
-- reads: path_outcome, named_path
-- param: place VARCHAR  Where the flows end; NULL: anywhere
-- column: path VARCHAR [path]  The path
-- column: steps VARCHAR[]  Its nodes, topics and services
-- column: roots BIGINT  Roots that arrived, or that a newer one replaced
-- column: reached BIGINT  Those that arrived
-- column: length_ns BIGINT [ns]  How long the recording, or the window, is
-- column: period_ns BIGINT [ns]  From one root to the next
-- column: latency_ns BIGINT [ns]  Mean latency of those that arrived
-- column: p95_ns BIGINT [ns]  95 % of them took no longer
-- column: age_ns BIGINT [ns]  Mean time from a root to data at the end that are as new
WITH span AS (
    SELECT least(end_ns, $end_ns) - greatest(start_ns, $start_ns) AS length_ns
    FROM main.run
    WHERE list_contains($runs, run_id)
),
judged AS (
    SELECT
        path_id, path,
        list_has_any(
            topics, (SELECT list(topic_name) FROM derive.heartbeat_topic($runs))
        ) IS TRUE AS is_plumbing
    FROM named_path
    WHERE is_path
),
chosen AS (
    SELECT path_id, path
    FROM judged
    WHERE $place IS NOT NULL OR NOT is_plumbing OR (SELECT bool_and(is_plumbing) FROM judged)
),
outcome AS (
    SELECT
        c.path, o.status, o.root_ns, o.sink_ns, o.latency_ns,
        count(*) FILTER (WHERE o.status = 'not_connected')
            OVER (PARTITION BY c.path ORDER BY o.root_ns) AS connection
    FROM path_outcome AS o
    JOIN chosen AS c ON o.path_id = c.path_id
    WHERE o.is_first IS NOT FALSE
),
root AS (
    SELECT
        path, root_ns, latency_ns,
        root_ns - lag(root_ns) OVER (PARTITION BY path ORDER BY root_ns) AS period_ns,
        min(CASE WHEN status = 'reached' THEN sink_ns END) OVER (
            PARTITION BY path, connection ORDER BY root_ns
            ROWS BETWEEN CURRENT ROW AND UNBOUNDED FOLLOWING
        ) - root_ns AS age_ns
    FROM outcome
    WHERE status IN ('reached', 'superseded', 'dropped', 'lost')
)
SELECT
    path,
    string_split(path, ' → ') AS steps,
    count(*) AS roots,
    count(latency_ns) AS reached,
    (SELECT length_ns FROM span) AS length_ns,
    quantile_disc(period_ns, 0.5) AS period_ns,
    avg(latency_ns)::BIGINT AS latency_ns,
    quantile_disc(latency_ns, 0.95) AS p95_ns,
    avg(age_ns)::BIGINT AS age_ns
FROM root
GROUP BY path
-- Below 0 where clocks are apart: no node makes such a path late.
HAVING avg(latency_ns) > 0
