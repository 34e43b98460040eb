-- title: Flows of runs that are compared
-- description: What `internal.fleet_run_value` reads of each run.
-- grain: one row per path, root and arrival; one per path and root that did not arrive
-- param: runs BIGINT[]  Runs
-- param: from VARCHAR  Topics or nodes where paths start; NULL: any
-- param: to VARCHAR  Topics or nodes where paths end; NULL: any
-- param: skip_first DOUBLE  Seconds left out at the start of each run
-- param: max_depth BIGINT  Longest path, in topics
-- param: max_paths BIGINT  Most paths, shortest first; also the limit on chains of each length
-- column: run VARCHAR  Id of the run
-- column: path VARCHAR  Nodes and topics of the path
-- column: status VARCHAR  As in main.end_to_end
-- column: latency_ns BIGINT [ns]  From the start of the root to the end; NULL: not reached
-- column: is_first BOOLEAN  First arrival of the root
-- column: is_last BOOLEAN  Last arrival of the root
-- column: is_newest BOOLEAN  Newest root of the arrival
-- column: is_loss_affected BOOLEAN  A gap of a trace overlaps its time
-- column: is_ambiguous BOOLEAN  It passes a link that may be another one
-- column: is_cut BOOLEAN  Paths of the run were left out beyond the limits
WITH path_chain AS MATERIALIZED (
    FROM main.flow_chain($runs, $from, $to, max_depth := $max_depth, max_paths := $max_paths)
)
SELECT
    e.run_id::VARCHAR AS run, p.path, e.status, e.latency_ns, e.is_first, e.is_last, e.is_newest,
    e.is_loss_affected, e.is_ambiguous, p.is_cut
FROM main.end_to_end($runs, $from, $to, chains := 'path_chain') AS e
JOIN main.flow_path($runs, only_paths := true, chains := 'path_chain') AS p ON e.path_id = p.path_id
JOIN main.run AS r ON e.run_id = r.run_id
WHERE e.root_ns >= r.start_ns + round($skip_first * 1e9)::BIGINT
ORDER BY run, p.path, e.root_ns, e.root_kind, e.root_id, e.sink_ns, e.take_id
