-- title: A callback that computes
-- description: Its thread is on a CPU most of the time that it takes.
-- grain: one row per node and callback
-- next: query callbacks --each --slowest 5 --node {node}
SELECT
    8 AS place,
    *,
    running_ns / measured_ns AS share
FROM long_callback
WHERE running_ns > 0.5 * measured_ns
