-- title: Files of the trace are damaged
-- description: Parts of the files could not be read: packets that are cut off, or bytes that make
--     no sense. Everything else was kept.
-- cause: The recording machine lost power or space, the session was never stopped, or the files
--     were copied while they were written.
-- cure: Stop the session before copying (lttng stop, lttng destroy), check the free space, copy
--     again and compare sizes.
-- grain: one row per damage, the first twenty of each trace, then one for the rest
-- severity: error
-- when: staging.damage
WITH damage AS (
    SELECT
        trace_index, file, position, byte_offset, message,
        row_number() OVER (PARTITION BY trace_index ORDER BY file, position, byte_offset, message)
            AS number
    FROM staging.damage
)
SELECT
    trace_index + 1 AS trace_id,
    1 AS count,
    printf('%s — %s, packet %d, byte %d', message, file, position, byte_offset) AS detail
FROM damage
WHERE number <= 20
UNION ALL
SELECT
    trace_index + 1,
    count(*),
    'further damage of the same trace'
FROM damage
WHERE number > 20
GROUP BY trace_index
