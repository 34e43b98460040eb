-- description: Where events are missing, by host.
-- grain: one row per gap of a trace
-- param: limit BIGINT {1..50000} = 20000  Most gaps, the longest
-- column: host
-- column: kind VARCHAR  'loss', 'packets' or 'pause'
-- column: start_at BIGINT [ns since origin]  Begin
-- column: length BIGINT [ns]  Length
-- column: event_count BIGINT  Events lost, where the tracer counted them
-- column: total BIGINT  Gaps of the run
WITH longest AS (
    SELECT
        h.hostname AS host,
        g.kind, g.start_ns, g.end_ns, g.event_count,
        count(*) OVER () AS total
    FROM main.gap AS g
    JOIN main.trace AS t ON g.trace_id = t.trace_id
    JOIN main.host AS h ON t.host_id = h.host_id
    WHERE g.run_id = $run AND g.start_ns IS NOT NULL AND g.end_ns IS NOT NULL
    ORDER BY g.end_ns - g.start_ns DESC, g.start_ns, g.trace_id, g.cpu
    LIMIT $limit
)
SELECT
    host, kind,
    start_ns - $origin_ns AS start_at,
    end_ns - start_ns AS length,
    event_count, total
FROM longest
ORDER BY start_at, length, host, kind, event_count
