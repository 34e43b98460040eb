-- title: Packets that one trace holds twice
-- description: Packets are in a trace twice. Each was read once.
-- cause: A stream file was copied beside itself.
-- cure: None needed. Without the copy, other tools read the trace right, too.
-- grain: one row, if there are any
-- severity: warning
-- when: staging.packet_read_once
SELECT
    sum(packet_count) AS count,
    'packets that one trace holds twice, such as those of a stream file copied beside itself, were '
    || 'read once' AS detail
FROM staging.packet_read_once
WHERE trace_index IS NOT NULL
HAVING count(*) > 0
