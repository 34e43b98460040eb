-- description: The clock here of what was recorded beside the traces: of its boot, where it names
--     one and the traces do; else of its host. The host is NULL where no trace has that name: a
--     container may have another than the machine. Times of a kernel trace may count from
--     elsewhere.
-- grain: one row per hostname and boot
-- when: raw.stack_sample, raw.usage
WITH clock AS (
    SELECT
        hostname, clock_key, clock_uuid,
        min(clock_origin_ns) AS origin_ns
    FROM staging.source
    WHERE domain IS DISTINCT FROM 'kernel'
    GROUP BY hostname, clock_key, clock_uuid
),
beside AS (
    SELECT
        hostname,
        NULL AS boot_id
    FROM raw.stack_sample
    UNION
    SELECT
        hostname,
        nullif(split_part(line, chr(9), 3), '')
    FROM raw.usage
    WHERE number = 0
)
SELECT
    b.hostname, b.boot_id,
    CASE WHEN bool_or(b.hostname = c.hostname) THEN b.hostname END AS known_hostname,
    CASE WHEN count(DISTINCT c.clock_key) = 1 THEN any_value(c.clock_key) END AS clock_key,
    min(c.origin_ns) AS origin_ns
FROM beside AS b
JOIN clock AS c
    ON coalesce(
        b.boot_id = c.clock_uuid,
        b.hostname = c.hostname OR b.hostname NOT IN (SELECT hostname FROM clock)
    )
GROUP BY b.hostname, b.boot_id
