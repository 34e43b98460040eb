-- description: Bars of the timeline for events of the user's own tracepoints, those inside of
--     callback instances.
-- grain: one row per event
-- column: row_key
-- column: kind UTINYINT  Kind of the bar
-- column: id BIGINT  Callback instance
-- column: start_at BIGINT [ns since origin]  When
-- column: length BIGINT [ns]  Always 0
-- column: flags
SELECT
    row_key, kind, id,
    start_ns - $origin_ns AS start_at,
    end_ns - start_ns AS length,
    flags
FROM segment
WHERE kind = 8 AND id >= 0
ORDER BY row_key, start_at, kind, id
