-- name: diagnostic.latency
-- kind: inline
-- description: Latencies of messages on the common time axis, and whether sender and receiver have
--     one clock.
-- grain: one row per link
SELECT
    l.run_id,
    bc.clock_id = tc.clock_id AS has_one_clock,
    derive.corrected_ns(t.taken_ns, tc.offset_ns, tc.drift_ppb, tc.reference_ns)
    - derive.corrected_ns(b.end_ns, bc.offset_ns, bc.drift_ppb, bc.reference_ns)
        AS latency_ns
FROM store.link_transport AS l
JOIN store.publication AS b ON l.publication_id = b.publication_id
JOIN derive.process_clock AS bc ON b.process_id = bc.process_id
JOIN store.take AS t ON l.take_id = t.take_id
JOIN derive.process_clock AS tc ON t.process_id = tc.process_id
