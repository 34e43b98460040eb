-- description: Packets whose key no other packet has, on the same clock and in the same direction,
--     within two seconds before and after: a retransmission, or a number that came round again,
--     cannot be taken for them. A key under which hosts of two clocks sent a packet is left out.
-- grain: one row per such packet
-- when: staging.network_packet
WITH spaced AS (
    SELECT
        event_id, trace_id, clock_id, ts_ns, is_sent, key,
        coalesce(ts_ns - lag(ts_ns) OVER along >= 2_000_000_000, true) AS is_first,
        coalesce(lead(ts_ns) OVER along - ts_ns >= 2_000_000_000, true) AS is_last
    FROM staging.network_packet
    WHERE key IS NOT NULL
    WINDOW along AS (PARTITION BY clock_id, is_sent, key ORDER BY ts_ns, event_id)
),
sent_twice AS (
    SELECT key
    FROM staging.network_packet
    WHERE is_sent AND key IS NOT NULL
    GROUP BY key
    HAVING min(clock_id) < max(clock_id)
)
SELECT p.event_id, p.trace_id, p.clock_id, p.ts_ns, p.is_sent, p.key
FROM spaced AS p
ANTI JOIN sent_twice AS t ON p.key = t.key
WHERE p.is_first AND p.is_last
