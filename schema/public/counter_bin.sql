-- description: Values of main.counter by pieces of time.
-- grain: one row per counter and piece of time in which it has a new value
-- param: runs
-- param: window_start_ns BIGINT  From this moment on, epoch ns
-- param: window_end_ns BIGINT  Only before this moment, epoch ns
-- param: width_ns BIGINT  Length of a piece
-- column: run_id
-- column: kind VARCHAR  As in main.counter
-- column: host_id BIGINT  Machine or container
-- column: process_id BIGINT  The process; NULL: a program without ROS
-- column: object_id BIGINT  Publisher, subscription, or the process
-- column: name VARCHAR  Topic, or program
-- column: start_ns BIGINT [epoch ns]  Begin of the piece
-- column: value DOUBLE  Messages in a second, the longest queue, or the most CPUs
-- column: last DOUBLE  Its last value, which holds until the next piece of the counter
CREATE OR REPLACE MACRO main.counter_bin(runs, window_start_ns, window_end_ns, width_ns) AS TABLE
SELECT
    run_id, kind, host_id, process_id, object_id, name,
    window_start_ns + (at_ns - window_start_ns) // width_ns * width_ns AS start_ns,
    -- A mean over time: of the periods, not of their rates.
    CASE WHEN kind = 'rate' THEN coalesce(1 / avg(1 / nullif(value, 0)), 0) ELSE max(value) END
        AS value,
    arg_max(value, (at_ns, place)) AS last
FROM main.counter(runs, window_start_ns, window_end_ns)
GROUP BY run_id, kind, host_id, process_id, object_id, name, start_ns
