-- description: Gaps of a host, those that touch as one: slices of a track are disjoint or nested.
-- grain: one row per gap of a host
WITH gap AS (
    SELECT
        t.host_id, g.kind, g.event_count,
        greatest(g.start_ns, $start_ns) AS start_ns,
        least(g.end_ns, $end_ns) AS end_ns
    FROM main.gap AS g
    JOIN main.trace AS t ON g.trace_id = t.trace_id
    WHERE g.run_id = $run_id AND g.start_ns < $end_ns AND g.end_ns >= $start_ns
),
begun AS (
    SELECT
        host_id, kind, event_count, start_ns, end_ns,
        coalesce(start_ns > max(end_ns) OVER (
            PARTITION BY host_id ORDER BY start_ns, end_ns
            ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        ), true) AS is_first
    FROM gap
),
numbered AS (
    SELECT
        host_id, kind, event_count, start_ns, end_ns,
        sum(is_first::BIGINT) OVER (
            PARTITION BY host_id ORDER BY start_ns, end_ns ROWS UNBOUNDED PRECEDING
        ) AS island
    FROM begun
)
SELECT
    n.host_id * 8 + 6 AS track,
    h.hostname || ': not recorded' AS track_name,
    'not recorded: ' || string_agg(DISTINCT n.kind, ', ' ORDER BY n.kind) AS name,
    min(n.start_ns) AS start_ns,
    max(n.end_ns) AS end_ns,
    sum(n.event_count)::BIGINT AS event_count
FROM numbered AS n
JOIN main.host AS h ON n.host_id = h.host_id
GROUP BY n.host_id, h.hostname, n.island
ORDER BY track, start_ns
