-- description: Samples as perf wrote them, each with the clock that its host has here. Times of
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
)
SELECT
    try_cast(p.pid AS INTEGER) AS pid,
    try_cast(p.tid AS INTEGER) AS tid,
    try_cast(p.cpu AS INTEGER) AS cpu,
    CASE WHEN p.is_monotonic THEN b.clock_key END AS clock_key,
    b.known_hostname AS hostname,
    p.is_monotonic,
    try_cast(p.second || rpad(p.fraction, 9, '0') AS BIGINT) + b.origin_ns AS at_ns,
    CASE WHEN p.event LIKE '%-clock%' THEN try_cast(p.period AS BIGINT) END AS cpu_ns,
    coalesce(nullif(p.stack, ''), p.only_frame) AS stack
FROM parsed AS p
LEFT JOIN staging.clock_beside AS b ON p.hostname = b.hostname AND b.boot_id IS NULL
WHERE p.event LIKE '%-clock%' OR p.event LIKE '%cycles%'
