-- description: What to add to a time of one clock to get the earliest time of another clock at
--     which a message sent then is received: the shortest way of any message in ten seconds.
--     Holds from `from_ns` of the sender's clock until the next row.
-- grain: one row per pair of clocks that exchange messages, and ten seconds
WITH way AS (
    SELECT
        l.run_id,
        fh.clock_id AS from_clock_id,
        th.clock_id AS to_clock_id,
        b.end_ns // 10_000_000_000 AS bucket,
        min(t.taken_ns - b.end_ns) AS shift_ns
    FROM store.link_transport AS l
    JOIN store.publication AS b ON l.publication_id = b.publication_id
    JOIN store.take AS t ON l.take_id = t.take_id
    JOIN store.process AS fp ON b.process_id = fp.process_id
    JOIN store.host AS fh ON fp.host_id = fh.host_id
    JOIN store.process AS tp ON t.process_id = tp.process_id
    JOIN store.host AS th ON tp.host_id = th.host_id
    WHERE fh.clock_id <> th.clock_id
    GROUP BY l.run_id, fh.clock_id, th.clock_id, bucket
)
SELECT
    run_id, from_clock_id, to_clock_id,
    CASE
        WHEN row_number() OVER (
            PARTITION BY run_id, from_clock_id, to_clock_id ORDER BY bucket
        ) > 1 THEN bucket * 10_000_000_000
        ELSE 0
    END AS from_ns,
    shift_ns
FROM way
