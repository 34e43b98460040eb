-- title: A kernel trace does not fit the ROS events
-- description: At most events of ROS processes, the kernel trace says that another thread ran on
--     their CPU. It is of another clock or machine, so that nothing is said of scheduling.
-- cause: The clocks differ: perf recorded without -k CLOCK_MONOTONIC, or another machine. Or an
--     old perf wrote all CPUs into one stream, and does not say which one an event is of.
-- cure: Record again with the clock of LTTng (docs/scheduling.md); convert with a newer perf.
-- grain: one row per kernel trace
-- severity: warning
-- when: staging.schedule
SELECT
    trace_index + 1 AS trace_id,
    event_count - agreeing_count AS count,
    CASE
        WHEN NOT has_cpus
            THEN 'the kernel trace does not say on which CPUs its events happened: not joined'
        WHEN event_count < 0.05 * (event_count + unknown_count) THEN printf(
            'the kernel trace contradicts itself at %d of %d events of ROS processes: not joined',
            unknown_count, event_count + unknown_count
        )
        WHEN event_count = 0
            THEN 'the kernel trace covers no event of a ROS process: not joined'
        ELSE printf(
            'the kernel trace agrees with %.1f %% of the events of ROS processes about which thread'
            || ' ran, with its times shifted by %+.6f s: not joined',
            100 * agreeing_count / event_count, shift_ns / 1e9
        ) END AS detail
FROM staging.schedule
WHERE NOT is_joined
