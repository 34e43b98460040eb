-- description: What passed between hosts of two clocks, and so shows how far these are apart:
--     messages matched by their stamps alone, requests, responses, and network packets. The
--     shortest delays in both directions bound the error of a correction. A negative one shows that
--     the clocks are apart.
-- grain: one row per pair of clocks and direction with messages or packets
-- column: run_id
-- column: from_clock_id BIGINT  Clock of the senders
-- column: to_clock_id BIGINT  Clock of the receivers
-- column: message_count BIGINT  Messages, requests and responses of ROS
-- column: packet_count BIGINT  Network packets that kernel traces saw on both ends
-- column: shortest_message_ns, shortest_packet_ns
WITH way AS (
    SELECT
        w.run_id, w.from_clock_id, w.to_clock_id, w.is_packet,
        derive.corrected_ns(w.received_ns, t) - derive.corrected_ns(w.sent_ns, f) AS way_ns
    FROM derive.clock_way AS w
    JOIN store.clock AS f ON w.from_clock_id = f.clock_id
    JOIN store.clock AS t ON w.to_clock_id = t.clock_id
)
SELECT
    run_id, from_clock_id, to_clock_id,
    count(CASE WHEN NOT is_packet THEN 1 END) AS message_count,
    count(CASE WHEN is_packet THEN 1 END) AS packet_count,
    min(CASE WHEN NOT is_packet THEN way_ns END) AS shortest_message_ns,
    min(CASE WHEN is_packet THEN way_ns END) AS shortest_packet_ns
FROM way
GROUP BY run_id, from_clock_id, to_clock_id
