-- description: What to add to a stamp made on a host to get the time of its trace: stamps are of
--     the clock that can be set, which traces do not follow. It is given as the least and the
--     greatest difference between the publication's layers and its stamp in ten seconds, so that
--     the shifted stamp says when the events of the publication were at the earliest and at the
--     latest. Holds from the stamp `from_ns` on.
-- grain: one row per host and ten seconds
WITH difference AS (
    SELECT
        l.run_id, p.host_id,
        t.source_timestamp_ns // 10_000_000_000 AS bucket,
        min(coalesce(b.dds_ns, b.rmw_ns, b.end_ns) - t.source_timestamp_ns) AS shift_ns,
        max(coalesce(b.dds_ns, b.rmw_ns, b.end_ns) - t.source_timestamp_ns) AS greatest_shift_ns
    FROM store.link_transport AS l
    JOIN store.publication AS b ON l.publication_id = b.publication_id
    JOIN store.take AS t ON l.take_id = t.take_id
    JOIN store.process AS p ON b.process_id = p.process_id
    WHERE t.source_timestamp_ns <> 0
    GROUP BY l.run_id, p.host_id, bucket
)
SELECT
    run_id, host_id,
    CASE
        WHEN row_number() OVER (PARTITION BY run_id, host_id ORDER BY bucket) > 1
            THEN bucket * 10_000_000_000
        ELSE 0
    END AS from_ns,
    shift_ns, greatest_shift_ns
FROM difference
