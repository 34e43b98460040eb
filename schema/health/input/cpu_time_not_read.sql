-- title: CPU time of a process is not known
-- description: A session reads the clocks of threads, but none of this process was read. It is not
--     known for how long its callbacks were on a CPU.
-- cause: The process may not call perf_event_open: the seccomp profile of its container, or
--     kernel.perf_event_paranoid, refuses it.
-- cure: docker run --cap-add PERFMON with a profile that allows perf_event_open, or
--     sysctl kernel.perf_event_paranoid=2. A kernel trace (msgflow record --kernel) knows it, too.
--     The tracer of Python nodes needs none of that.
-- grain: one row per process
-- severity: info
-- when: staging.reader
SELECT
    i.process_id,
    count(*) AS count,
    'callback instances without CPU time' AS detail
FROM staging.callback_extent AS i
LEFT JOIN staging.callback_cpu AS c ON i.callback_instance_id = c.callback_instance_id
JOIN staging.process AS p ON i.process_id = p.process_id
WHERE i.end_ns IS NOT NULL
    AND p.host_id IN (
        SELECT s.host_id
        FROM staging.placed_source AS s
        JOIN staging.reader AS r ON s.trace_index = r.trace_index
    )
GROUP BY i.process_id
HAVING count(c.callback_instance_id) = 0
