-- title: The kernel trace lacks switches
-- description: A switch names another thread than the switch before it put on the CPU. What ran in
--     between is not known. A thread that leaves the CPU then had it at least since its first
--     event of ROS there. From its waking until that event it is 'unknown'.
-- cause: In some virtual machines, perf has no switches away from idle, on some CPUs. Or kernel
--     events were lost (kernel_events_lost).
-- cure: Record with LTTng's kernel modules, or outside of the virtual machine (docs/scheduling.md).
-- grain: one row per kernel trace in which a twentieth of the time of a CPU, or more, is not known
-- severity: warning
-- when: staging.cpu_schedule
SELECT
    s.trace_index + 1 AS trace_id,
    s.unknown_count AS count,
    printf(
        'what ran is not known for %s%s, at %d of %d events of ROS processes',
        array_to_string(list(
            printf('%.1f %% of the time of CPU %d', 100 - 100 * c.known_ns / c.length_ns, c.cpu)
            ORDER BY c.known_ns / c.length_ns, c.cpu
        )[:3], ', '),
        CASE WHEN count(*) > 3
            THEN printf(', and part of the time of %d more CPUs', count(*) - 3) ELSE '' END,
        s.unknown_count, s.event_count + s.unknown_count
    ) AS detail
FROM staging.schedule AS s
JOIN staging.cpu_schedule AS c ON s.trace_index = c.trace_index
WHERE s.is_joined AND c.length_ns > 0 AND c.known_ns <= 0.95 * c.length_ns
GROUP BY s.trace_index, s.unknown_count, s.event_count
