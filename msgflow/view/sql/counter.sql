-- description: Counters by pieces of time (main.counter_bin): queues of subscriptions in which
--     several messages wait at some time, and CPUs that programs used; else rates of publishers.
-- grain: one row per counter and piece of time in which it has a new value
-- param: rates BIGINT {0..1} = 0  1: rates alone
-- param: bins BIGINT {1..2000} = 300  Number of pieces
-- column: kind VARCHAR  'rate', 'queue' or 'cpu'
-- column: row_key BIGINT  Row of the publisher or subscription; NULL: of a program
-- column: host
-- column: process_id BIGINT  The process; NULL: a program without ROS
-- column: name VARCHAR  Topic, or program
-- column: start_at, length
-- column: value DOUBLE  Messages in a second, the longest queue, or the most CPUs
-- column: last DOUBLE  Value that holds until the next piece
SELECT
    c.kind,
    8 * c.object_id + CASE c.kind WHEN 'rate' THEN 4 WHEN 'queue' THEN 1 END AS row_key,
    h.hostname AS host,
    c.process_id, c.name,
    c.start_ns - $origin_ns AS start_at,
    e.width AS length,
    c.value, c.last
FROM main.counter_bin(
    [$run], $start_ns, $end_ns, ($end_ns - $start_ns) // $bins + 1
) AS c
CROSS JOIN extent AS e
JOIN main.host AS h ON c.host_id = h.host_id
WHERE (c.kind = 'rate') = ($rates = 1)
QUALIFY c.kind <> 'queue' OR max(c.value) OVER (PARTITION BY c.kind, c.object_id) > 1
ORDER BY c.kind, row_key, host, c.process_id, c.name, start_at
