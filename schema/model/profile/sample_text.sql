-- description: Samples as perf wrote them, each with the clock that its host has here. Times of
--     another clock than LTTng's are of none. Only samples of time count (is_of_time): those of a
--     CPU's clock or of cycles, and not of cache misses or tracepoints. It is not known where perf
--     was not asked for ids of process and thread, and for the time; others have no stack.
-- grain: one row per sample
-- when: raw.stack_sample
WITH parsed AS (
    SELECT
        hostname, is_monotonic, stack, head,
        unnest(regexp_extract(
            head,
            '(\d+)/(\d+) +(?:\[(\d+)\] +)?(\d+)\.(\d{6,9}): +(?:(\d+) +)?(\S+?):'
            || '(?:\s+([0-9a-f]+ .*))?\s*$',
            ['pid', 'tid', 'cpu', 'second', 'fraction', 'period', 'event', 'only_frame']
        ))
    FROM raw.stack_sample
),
judged AS (
    SELECT
        *,
        CASE WHEN event <> '' THEN regexp_matches(event, '-clock|cycles') END AS is_of_time
    FROM parsed
    -- A name, of 15 bytes at most, may have ends of lines: only the last of them has an event.
    WHERE event <> ''
        OR regexp_matches(head, '\d+ .*\S:(\s+[0-9a-f]+ .*)?\s*$')
        OR length(head) > 15
)
SELECT
    p.is_of_time,
    try_cast(p.pid AS INTEGER) AS pid,
    try_cast(p.tid AS INTEGER) AS tid,
    try_cast(p.cpu AS INTEGER) AS cpu,
    CASE WHEN p.is_monotonic THEN b.clock_key END AS clock_key,
    b.known_hostname AS hostname,
    p.is_monotonic,
    try_cast(p.second || rpad(p.fraction, 9, '0') AS BIGINT) + b.origin_ns AS at_ns,
    CASE WHEN p.event LIKE '%-clock%' THEN try_cast(p.period AS BIGINT) END AS cpu_ns,
    CASE WHEN p.is_of_time THEN coalesce(nullif(p.stack, ''), p.only_frame) END AS stack
FROM judged AS p
LEFT JOIN staging.clock_beside AS b ON p.hostname = b.hostname AND b.boot_id IS NULL
