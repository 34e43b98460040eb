-- kind: inline
-- description: Clocks that messages or packets went between, if messages were to bring those of the
--     run together.
-- grain: one row per pair of clocks
SELECT
    p.clock_id, p.other_clock_id, c.name,
    o.name AS other_name,
    p.received_count, p.sent_count, p.received_packet_count, p.sent_packet_count, p.offset_ns,
    p.uncertainty_ns, p.is_even
FROM derive.clock_pair(
    (SELECT run_id FROM derive.clocks_to_synchronise WHERE run_id = $run_id)
) AS p
JOIN clock_name AS c ON p.clock_id = c.clock_id
JOIN clock_name AS o ON p.other_clock_id = o.clock_id
