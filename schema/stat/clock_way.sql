-- name: derive.clock_way
-- description: What was sent on one clock and received on another: messages matched by their
--     stamps where there is no other candidate, which needs no comparison of the two clocks, and
--     network packets.
-- grain: one row per message or packet between two clocks
-- needs: store.link_transport, store.publication, store.take, store.process, store.host,
--     store.link_packet, store.trace
WITH process_clock AS (
    SELECT p.process_id, h.clock_id
    FROM store.process AS p
    JOIN store.host AS h ON p.host_id = h.host_id
),
trace_clock AS (
    SELECT t.trace_id, h.clock_id
    FROM store.trace AS t
    JOIN store.host AS h ON t.host_id = h.host_id
)
SELECT
    l.run_id, f.clock_id AS from_clock_id, o.clock_id AS to_clock_id, false AS is_packet,
    b.end_ns AS sent_ns, t.taken_ns AS received_ns
FROM store.link_transport AS l
JOIN store.publication AS b ON l.publication_id = b.publication_id
JOIN store.take AS t ON l.take_id = t.take_id
JOIN process_clock AS f ON b.process_id = f.process_id
JOIN process_clock AS o ON t.process_id = o.process_id
WHERE l.method IN ('exact', 'nearest')
    AND l.candidate_count = 1
    AND f.clock_id <> o.clock_id
UNION ALL
SELECT l.run_id, f.clock_id, o.clock_id, true, l.sent_ns, l.received_ns
FROM store.link_packet AS l
JOIN trace_clock AS f ON l.sent_trace_id = f.trace_id
JOIN trace_clock AS o ON l.received_trace_id = o.trace_id
