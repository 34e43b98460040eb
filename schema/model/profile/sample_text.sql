-- description: Samples as perf wrote them, each with the clock that its host has here. The host
--     is NULL where no trace has that name: a container may have another than the machine. Times of
--     another clock than LTTng's are of none. Only samples of time count: those of a CPU's clock or
--     of cycles, and not of cache misses or tracepoints.
-- grain: one row per sample
-- when: raw.stack_sample
WITH parsed AS (
    SELECT
        hostname, is_monotonic, stack,
        unnest(regexp_extract(
            head,
            '(\d+)/(\d+) +(?:\[(\d+)\] +)?(\d+)\.(\d{6,9}): +(?:(\d+) +)?(\S+?):'
            || '(?:\s+([0-9a-f]+ .*))?\s*$',
            ['pid', 'tid', 'cpu', 'second', 'fraction', 'period', 'event', 'only_frame']
        ))
    FROM raw.stack_sample
),
-- The times of a kernel trace may count from elsewhere.
clock AS (
    SELECT
        hostname, clock_key,
        min(clock_origin_ns) AS origin_ns
    FROM staging.source
    WHERE domain IS DISTINCT FROM 'kernel'
    GROUP BY hostname, clock_key
),
host AS (
    SELECT
        s.hostname,
        bool_or(s.hostname = c.hostname) AS is_known,
        CASE WHEN count(DISTINCT c.clock_key) = 1 THEN any_value(c.clock_key) END AS clock_key,
        min(c.origin_ns) AS origin_ns
    FROM (SELECT DISTINCT hostname FROM raw.stack_sample) AS s
    JOIN clock AS c ON s.hostname = c.hostname OR s.hostname NOT IN (SELECT hostname FROM clock)
    GROUP BY s.hostname
)
SELECT
    try_cast(p.pid AS INTEGER) AS pid,
    try_cast(p.tid AS INTEGER) AS tid,
    try_cast(p.cpu AS INTEGER) AS cpu,
    CASE WHEN p.is_monotonic THEN h.clock_key END AS clock_key,
    CASE WHEN h.is_known THEN h.hostname END AS hostname,
    p.is_monotonic,
    try_cast(p.second || rpad(p.fraction, 9, '0') AS BIGINT) + h.origin_ns AS at_ns,
    CASE WHEN p.event LIKE '%-clock%' THEN try_cast(p.period AS BIGINT) END AS cpu_ns,
    coalesce(nullif(p.stack, ''), p.only_frame) AS stack
FROM parsed AS p
LEFT JOIN host AS h ON p.hostname = h.hostname
WHERE p.event LIKE '%-clock%' OR p.event LIKE '%cycles%'
