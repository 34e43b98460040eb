-- title: Packets that several traces hold
-- description: Packets are in several of the given traces. Each was read once.
-- cause: A recording was given twice, as when snapshots or copies of it overlap.
-- cure: None needed.
-- grain: one row, if there are any
-- severity: info
-- when: staging.packet_read_once
SELECT
    packet_count AS count,
    'packets that several of the given traces hold were read once' AS detail
FROM staging.packet_read_once
WHERE trace_index IS NULL
