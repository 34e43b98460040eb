-- description: What `internal.fleet_run_value` reads of each run.
-- grain: one row per path, root and arrival; one per path and root that did not arrive
-- param: runs
-- param: from VARCHAR  Topics or nodes where paths start; NULL: any
-- param: to VARCHAR  Topics or nodes where paths end; NULL: any
-- param: skip_first DOUBLE  Seconds left out at the start of each run
-- param: max_depth BIGINT  Longest path, in topics
-- param: max_paths BIGINT  Most paths, shortest first; also the limit on chains of each length
WITH path_chain AS MATERIALIZED (
    FROM main.flow_chain($runs, $from, $to, max_depth := $max_depth, max_paths := $max_paths)
),
named_path AS MATERIALIZED (
    SELECT path_id, alike_id, path, is_cut
    FROM main.flow_path($runs, only_paths := true, chains := 'path_chain')
)
SELECT
    e.run_id::VARCHAR AS run,
    p.path, e.status, e.latency_ns, e.is_first, e.is_last, e.is_newest, e.is_loss_affected,
    e.is_ambiguous, p.is_cut
FROM main.end_to_end($runs, $from, $to, chains := 'path_chain', paths := 'named_path') AS e
JOIN named_path AS p ON e.path_id = p.path_id
JOIN main.run AS r ON e.run_id = r.run_id
WHERE e.root_ns >= r.start_ns + round($skip_first * 1e9)::BIGINT
ORDER BY run, p.path, e.root_ns, e.root_kind, e.root_id, e.sink_ns, e.take_id
