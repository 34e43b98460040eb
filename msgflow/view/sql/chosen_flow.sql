-- description: Flows of a path, or of every one, that began in a window.
-- grain: one row per flow
-- kind: inline
-- column: path_id BIGINT  Number of the path
-- column: root_at BIGINT [ns since origin]  Start of the root
-- column: root_kind VARCHAR  'callback_instance', 'publication' or 'take'
-- column: root_id BIGINT  Identity of the root
-- column: take_id BIGINT  Take at the end; NULL: not reached
-- column: latency BIGINT [ns]  Latency; NULL: not reached
-- column: status VARCHAR  As in main.end_to_end
SELECT path_id, root_at, root_kind, root_id, take_id, latency, status
FROM flow
WHERE run_id = $run
    AND ($path IS NULL OR path_id = $path)
    AND ($begin_at IS NULL OR root_at >= $begin_at)
    AND ($end_at IS NULL OR root_at < $end_at)
