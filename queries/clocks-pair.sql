-- title: Messages and packets by which clocks are corrected
-- description: Messages and network packets between hosts of two clocks, for each direction, with
--     the shortest delay of each after the current correction. A correction needs both directions;
--     the shorter both delays, the more exact it is.
-- grain: one row per pair of clocks and direction with messages or packets
-- column: run_id
-- column: from_hosts VARCHAR [host]  Hosts of the clock that sent
-- column: to_hosts VARCHAR [host]  Hosts of the clock that received
-- column: message_count BIGINT                Messages of ROS matched by their stamps alone,
--     requests and responses
-- column: packet_count BIGINT                 Network packets that kernel traces recorded at both
--     ends
-- column: shortest_message_ns, shortest_packet_ns
-- brief: from_hosts, to_hosts, message_count, shortest_message_ns, packet_count, shortest_packet_ns
WITH named AS (
    SELECT
        clock_id,
        string_agg(hostname, ', ' ORDER BY host_id) AS hosts
    FROM main.host
    GROUP BY clock_id
)
SELECT
    p.run_id,
    f.hosts AS from_hosts,
    t.hosts AS to_hosts,
    p.message_count, p.packet_count, p.shortest_message_ns, p.shortest_packet_ns
FROM main.clock_pair AS p
LEFT JOIN named AS f ON p.from_clock_id = f.clock_id
LEFT JOIN named AS t ON p.to_clock_id = t.clock_id
WHERE list_contains($runs, p.run_id)
ORDER BY p.run_id, least(p.from_clock_id, p.to_clock_id), greatest(p.from_clock_id, p.to_clock_id),
    p.from_clock_id
