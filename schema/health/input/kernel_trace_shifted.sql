-- title: A kernel trace of another epoch was shifted
-- description: The kernel trace names no clock of a ROS process. Shifted so that both count from
--     the origin of one clock, it agrees with the events of ROS processes.
-- cause: perf's trace counts from the start of the machine.
-- cure: None needed.
-- grain: one row per kernel trace
-- severity: info
-- when: staging.schedule
SELECT
    trace_index + 1 AS trace_id,
    agreeing_count AS count,
    printf(
        'the kernel trace was shifted by %+.6f s: it agrees with %.2f %% of the events of ROS '
        || 'processes about which thread ran',
        shift_ns / 1e9, 100 * agreeing_count / event_count
    ) AS detail
FROM staging.schedule
WHERE is_joined AND shift_ns <> 0
