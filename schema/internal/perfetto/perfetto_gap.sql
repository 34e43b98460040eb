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
-- A gap belongs to the last one before it that touches none before.
begun AS (
    SELECT
        *,
        CASE WHEN start_ns <= max(end_ns) OVER (
            PARTITION BY host_id ORDER BY start_ns, end_ns
            ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        ) THEN NULL ELSE start_ns END AS first_ns
    FROM gap
),
joined AS (
    SELECT
        *,
        max(first_ns) OVER (
            PARTITION BY host_id ORDER BY start_ns, end_ns ROWS UNBOUNDED PRECEDING
        ) AS joined_ns
    FROM begun
)
SELECT
    j.host_id,
    h.hostname || ': not recorded' AS track,
    'gap' AS category,
    'not recorded: ' || string_agg(DISTINCT j.kind, ', ' ORDER BY j.kind) AS name,
    j.joined_ns AS start_ns,
    max(j.end_ns) AS end_ns,
    sum(j.event_count)::BIGINT AS lost_events
FROM joined AS j
JOIN main.host AS h ON j.host_id = h.host_id
GROUP BY j.host_id, h.hostname, j.joined_ns
ORDER BY j.host_id, start_ns
