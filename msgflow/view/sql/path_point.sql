-- description: Flows of a path one by one, or, where they are many, the slowest of each piece of
--     time with the median of the piece.
-- grain: one row per flow, or per piece of time with flows
-- param: path
-- param: limit BIGINT {1..50000} = 2000  Most rows
-- param: begin_at, end_at
-- column: root_at, root_kind, root_id
-- column: take_id BIGINT  Take at the end of the path; NULL: not reached
-- column: latency BIGINT [ns]  Latency; of the slowest in the piece
-- column: median BIGINT [ns]  Median of the piece; the latency itself where flows are one by one
-- column: count BIGINT  Flows in the piece
-- column: missing BIGINT  Of these, flows that did not arrive; not those that were not connected, or
--     that the recording cut
WITH numbered AS (
    SELECT
        root_at, root_kind, root_id, take_id, latency, status,
        count(*) OVER () AS number,
        min(root_at) OVER () AS first_at,
        max(root_at) OVER () AS last_at
    FROM chosen_flow
)
SELECT
    arg_max(root_at, coalesce(latency, -1)) AS root_at,
    arg_max(root_kind, coalesce(latency, -1)) AS root_kind,
    arg_max(root_id, coalesce(latency, -1)) AS root_id,
    arg_max(take_id, latency) AS take_id,
    max(latency) AS latency,
    quantile_disc(latency, 0.5) AS median,
    count(*) AS count,
    count(*) FILTER (WHERE status NOT IN ('reached', 'not_connected', 'cut_by_recording')) AS missing
FROM numbered
GROUP BY
    CASE WHEN number <= $limit THEN root_id
        ELSE (root_at - first_at) * $limit // (last_at - first_at + 1) END,
    CASE WHEN number <= $limit THEN root_kind END
ORDER BY root_at, root_kind, root_id
