-- description: What tells a run from others wherever it was read: the identity of its packets, as
--     the database knows packets again, put together to a hash of 20 hexadecimal digits.
-- grain: one row
-- param: runs BIGINT[]  One run
SELECT left(sha256(string_agg(packet, chr(10) ORDER BY packet)), 20) AS run
FROM (
    SELECT DISTINCT
        concat_ws(
            ' ', coalesce(t.uuid, '-'), p.stream_class_id, coalesce(p.stream_instance_id, -1),
            p.begin_ns
        ) AS packet
    FROM store.packet AS p
    JOIN store.trace AS t ON p.trace_id = t.trace_id
    WHERE list_contains($runs, p.run_id)
)
