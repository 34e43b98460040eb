-- name: diagnostic.clock_name
-- kind: inline
-- description: How clocks are named in details.
-- grain: one row per clock of the run
-- param: run_id BIGINT  Run
SELECT clock_id, string_agg(hostname, ', ' ORDER BY host_id) AS name
FROM store.host
WHERE run_id = $run_id
GROUP BY clock_id
