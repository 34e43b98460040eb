-- name: staging.declared_tid
-- description: Ids of threads in PID namespaces, as kernel traces declare them: in contexts of
--     switches (`source` is 'context'), when a recording begins ('state dump'), and when a thread
--     is created ('fork'). What was still so later has `until_ns`.
-- grain: one row per declaration
-- when: staging.schedule
WITH dump AS (
    SELECT
        trace_index, ts_ns, tid, namespace_tid AS vtid, namespace_pid AS vpid, ns_inum
    FROM raw.lttng_statedump_process_state
    WHERE namespace_tid IS NOT NULL
    UNION ALL
    SELECT trace_index, ts_ns, tid, namespace_tid, namespace_pid, ns_inum
    FROM raw.lttng_statedump_process_pid_ns
),
fork AS (
    SELECT trace_index, ts_ns, child_tid AS tid, child_pid, vtids[-1] AS vtid, child_ns_inum
    FROM raw.sched_process_fork
    WHERE len(vtids) > 0
),
-- A process has the number of its first thread.
main_thread AS (
    SELECT trace_index, ts_ns, tid, vtid FROM fork WHERE tid = child_pid
    UNION ALL
    SELECT trace_index, ts_ns, tid, arg_max(vtid, ns_inum) FROM dump WHERE vtid = vpid GROUP BY ALL
),
declared AS (
    SELECT
        trace_index, first_ns AS ts_ns, last_ns, tid, vpid, vtid, pid_ns AS ns_inum,
        'context' AS source
    FROM raw.kernel_thread
    UNION ALL
    SELECT trace_index, ts_ns, NULL, tid, vpid, vtid, ns_inum, 'state dump' FROM dump
    UNION ALL
    SELECT f.trace_index, f.ts_ns, NULL, f.tid, m.vtid, f.vtid, f.child_ns_inum, 'fork'
    FROM fork AS f
    ASOF JOIN main_thread AS m
        ON f.trace_index = m.trace_index AND f.child_pid = m.tid AND f.ts_ns >= m.ts_ns
)
SELECT
    s.clock_key, d.tid, d.vpid, d.vtid, d.ns_inum, d.ts_ns + s.shift_ns AS declared_ns,
    d.last_ns + s.shift_ns AS until_ns, d.source
FROM declared AS d
JOIN staging.schedule AS s ON d.trace_index = s.trace_index
WHERE s.is_joined
