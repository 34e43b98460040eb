-- description: The number that the kernel has for each thread. A declaration counts: contexts of
--     switches while its process lived, else the latest of the state dump and its creation; unless
--     it is of several threads or the schedule contradicts it. Else it is what ran on the CPU at
--     most events of the thread. `source` says which: 'context', 'state dump', 'fork' or
--     'schedule'. The number means this thread from `from_ns` on, and the next one from `until_ns`
--     on.
-- grain: one row per thread of a process life and number
-- when: staging.schedule
WITH dump AS (
    SELECT trace_index, ts_ns, tid, namespace_tid AS vtid, namespace_pid AS vpid, ns_inum
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
declaration AS (
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
),
-- Ids of threads in PID namespaces, as kernel traces declare them: in contexts of switches, when a
-- recording begins, and when a thread is created. What was still so later has `until_ns`.
declared_tid AS (
    SELECT
        s.clock_key, d.tid, d.vpid, d.vtid, d.ns_inum, d.ts_ns + s.shift_ns AS declared_ns,
        d.last_ns + s.shift_ns AS until_ns, d.source
    FROM declaration AS d
    JOIN staging.schedule AS s ON d.trace_index = s.trace_index
    WHERE s.is_joined
),
ran AS (
    SELECT
        x.thread_id, m.tid, count(*) AS event_count,
        min(m.at_ns + s.shift_ns) AS first_ns, max(m.at_ns + s.shift_ns) AS last_ns
    FROM staging.schedule_moment AS m
    JOIN staging.schedule AS s ON m.candidate_number = s.candidate_number
    JOIN staging.context AS x
        ON m.thread_index = x.thread_index
        AND m.event_id >= x.from_event_id
        AND m.event_id < x.until_event_id
    WHERE s.is_joined AND m.tid <> 0
    GROUP BY x.thread_id, m.tid
    QUALIFY count(*) >= 0.05 * sum(count(*)) OVER (PARTITION BY x.thread_id)
),
-- A process that was started again may have the same ids: its thread has one number after the
-- other.
pattern AS (
    SELECT r.thread_id, r.tid, r.first_ns
    FROM ran AS r
    WHERE NOT EXISTS (
        SELECT 1
        FROM ran AS o
        WHERE o.thread_id = r.thread_id
            AND o.tid <> r.tid
            AND (o.event_count, o.tid) > (r.event_count, r.tid)
            AND o.first_ns <= r.last_ns
            AND o.last_ns >= r.first_ns
    )
),
lived AS (
    SELECT
        t.thread_id, t.tid AS vtid, t.first_seen_ns, t.last_seen_ns, p.pid AS vpid,
        p.first_seen_ns AS process_first_ns, p.last_seen_ns AS process_last_ns, p.pid_namespace,
        c.clock_key
    FROM staging.thread AS t
    JOIN staging.process AS p ON t.process_id = p.process_id
    JOIN staging.host AS h ON p.host_id = h.host_id
    JOIN staging.clock AS c ON h.clock_id = c.clock_id
),
latest AS (
    SELECT
        v.thread_id, d.source, d.tid, d.declared_ns,
        -- A dump declares all threads at about the same time, contexts do so again and again.
        CASE d.source WHEN 'fork' THEN d.declared_ns ELSE 0 END AS rank_ns
    FROM lived AS v
    JOIN declared_tid AS d
        ON v.clock_key = d.clock_key
        AND v.vpid = d.vpid
        AND v.vtid = d.vtid
        AND CASE d.source
            WHEN 'context'
                THEN d.declared_ns <= v.process_last_ns AND d.until_ns >= v.process_first_ns
            ELSE d.declared_ns <= v.last_seen_ns
        END
        AND coalesce(v.pid_namespace = d.ns_inum, true)
    QUALIFY rank() OVER (
        PARTITION BY v.thread_id ORDER BY d.source = 'context' DESC, rank_ns DESC
    ) = 1
),
declared AS (
    SELECT thread_id, any_value(tid) AS tid, any_value(source) AS source
    FROM latest
    GROUP BY thread_id
    HAVING count(DISTINCT tid) = 1
),
known AS (
    SELECT
        v.thread_id, v.clock_key,
        coalesce(p.first_ns, v.first_seen_ns) AS first_ns,
        coalesce(p.tid, d.tid) AS tid,
        CASE WHEN d.tid = coalesce(p.tid, d.tid) THEN d.source ELSE 'schedule' END AS source
    FROM lived AS v
    LEFT JOIN pattern AS p ON v.thread_id = p.thread_id
    LEFT JOIN declared AS d ON v.thread_id = d.thread_id
    WHERE coalesce(p.tid, d.tid) IS NOT NULL
)
SELECT
    thread_id, clock_key, tid, source,
    CASE WHEN row_number() OVER number = 1 THEN -4611686018427387904 ELSE first_ns END AS from_ns,
    lead(first_ns, 1, 4611686018427387904) OVER number AS until_ns
FROM known
WINDOW number AS (PARTITION BY clock_key, tid ORDER BY first_ns, thread_id)
