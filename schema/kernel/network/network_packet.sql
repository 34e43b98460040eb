-- description: Packets that kernel traces saw being handed to a network device or coming from one.
--     `key` is equal for the two ends of a packet's way and, as far as its headers allow, for no
--     other packet: addresses, ports, the identification of the datagram; for TCP the sequence and
--     acknowledgement numbers, for UDP the length. The checksum identifies a UDP datagram without
--     identification. TCP segments count without their length, since a network card cuts or joins
--     them on the way, and without their checksum, which it fills in: the first of them still is
--     not received before all were sent. NULL for a later fragment, for a packet that looks like
--     others, and for one that stays on its host (127.0.0.0/8, ::1), which tells nothing of other
--     clocks.
-- grain: one row per packet sent or received on a host
-- when: raw.net_dev_queue, raw.net_if_receive_skb
WITH recorded AS (
    SELECT
        *,
        true AS is_sent
    FROM raw.net_dev_queue
    UNION ALL
    SELECT *, false
    FROM raw.net_if_receive_skb
)
SELECT
    p.event_id, t.trace_id, h.clock_id, p.ts_ns, p.is_sent,
    CASE
        WHEN p.source_port IS NULL OR coalesce(p.fragment % 8192, 0) > 0 THEN NULL
        WHEN p.source_address[1] = 127 AND len(p.source_address) = 4 THEN NULL
        WHEN p.source_address = [0, 0, 0, 0, 0, 0, 0, 1] THEN NULL
        WHEN p.sequence_number IS NOT NULL THEN hash(
            p.source_address, p.destination_address, p.source_port, p.destination_port,
            p.identification, p.sequence_number, p.acknowledgement
        )
        WHEN coalesce(nullif(p.identification, 0), nullif(p.udp_checksum, 0)) IS NOT NULL THEN hash(
            p.source_address, p.destination_address, p.source_port, p.destination_port,
            p.identification, p.udp_length,
            CASE WHEN coalesce(p.identification, 0) = 0 THEN p.udp_checksum END
        )
    END AS key
FROM recorded AS p
JOIN staging.trace AS t ON p.trace_index + 1 = t.trace_id
JOIN staging.host AS h ON t.host_id = h.host_id
