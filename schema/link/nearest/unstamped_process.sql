-- name: derive.unstamped_process
-- kind: macro
-- description: Processes that publish and never show the stamp of a message.
-- grain: one row per such process
-- param: only_run BIGINT  Run to look at
CREATE OR REPLACE MACRO derive.unstamped_process(only_run) AS TABLE
SELECT process_id
FROM store.publication
WHERE run_id = only_run
GROUP BY process_id
HAVING count(source_timestamp_ns) = 0
