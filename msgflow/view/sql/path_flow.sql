-- description: The flows that e2e-latency counts: the first arrival of each root, or why there is
--     none. Kept by the page for its pictures of single paths.
-- grain: one row per printed path and root
-- param: start_ns
-- column: path_id BIGINT  Number of the path
-- column: root_kind, root_id, root_at
-- column: take_id BIGINT  Take at the end of the path; NULL: not reached
-- column: latency BIGINT [ns]  From the start of the root to the end; NULL: not reached, or a message
--     on the way was stored until its subscription existed
-- column: status VARCHAR  As in flows
-- column: is_loss_affected BOOLEAN  A gap of a trace lies in its time
WITH named_path AS MATERIALIZED (
    SELECT path_id, alike_id FROM main.flow_path([$run], only_paths := true)
)
SELECT
    alike_id AS path_id,
    root_kind, root_id,
    root_ns - $origin_ns AS root_at,
    take_id,
    latency_ns AS latency,
    status, is_loss_affected
FROM main.end_to_end(
    [$run], window_start_ns := $start_ns, window_end_ns := $end_ns, paths := 'named_path'
)
WHERE is_first IS NOT false
ORDER BY path_id, root_at, root_kind, root_id
