-- description: Flows of a path, or of every one, that began in a window.
-- grain: one row per flow
-- kind: inline
-- reads: flow
SELECT path_id, root_at, root_kind, root_id, take_id, latency, status
FROM flow
WHERE run_id = $run
    AND ($path IS NULL OR path_id = $path)
    AND ($begin_at IS NULL OR root_at >= $begin_at)
    AND ($end_at IS NULL OR root_at < $end_at)
