-- name: diagnostic.lost_packets
-- title: Packets that are missing
-- description: Whole packets were overwritten or are missing.
-- finding: lost_packets
-- grain: one row per trace
-- severity: data_loss
-- phase: reading
SELECT
    trace_id,
    count(*) AS count,
    'places where whole packets were overwritten or are missing' AS detail
FROM staging.gap
WHERE kind = 'packets'
GROUP BY trace_id
