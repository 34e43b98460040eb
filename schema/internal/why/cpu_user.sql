-- title: What has the CPU for which callbacks wait
-- description: By program. A kernel trace shows how long its threads had the CPU while threads of
--     callbacks were ready; else samples show what used most of the CPUs.
-- grain: one row per node, the worst program alone
-- reads: callback_name
-- column: node VARCHAR  Node whose threads wait
-- column: program VARCHAR  What had the CPU longest: its command or name, and its pid or thread, or
--     how many they were
-- column: reason VARCHAR  Why the CPU was idle meanwhile, as main.withheld_cpu has it; NULL: a
--     program had it
-- column: used_cpus DOUBLE  CPUs that it used, on average; NULL: not sampled
-- column: cpus INTEGER  CPUs of the machine; NULL: not sampled
WITH waited AS (
    SELECT DISTINCT l.node, l.process_id, p.host_id, i.thread_id
    FROM main.callback_instance AS i
    JOIN callback_name AS l ON i.callback_id = l.callback_id
    JOIN main.process AS p ON l.process_id = p.process_id
    WHERE list_contains($runs, i.run_id)
),
taken AS (
    SELECT
        w.node,
        coalesce(l.nodes, o.program, '?') AS name,
        i.reason,
        coalesce(h.tid, o.tid) AS number,
        p.end_ns - p.start_ns AS length_ns,
        NULL::DOUBLE AS used_cpus,
        0 AS place,
        'threads' AS what
    FROM waited AS w
    JOIN main.preemptor AS p ON w.thread_id = p.thread_id
    LEFT JOIN main.thread AS h ON p.preemptor_thread_id = h.thread_id
    LEFT JOIN main.other_thread AS o ON p.preemptor_other_thread_id = o.other_thread_id
    LEFT JOIN main.process_label AS l ON coalesce(h.process_id, o.process_id) = l.process_id
    LEFT JOIN main.withheld_cpu AS i
        ON p.is_cpu_idle AND p.thread_id = i.thread_id AND p.start_ns = i.start_ns
    WHERE p.start_ns >= $start_ns AND p.start_ns < $end_ns
        -- A CPU that is idle for less is not taken, and what records is gone without it.
        AND (NOT p.is_cpu_idle OR i.reason IS NOT NULL)
        AND NOT coalesce(o.is_recorder, false)
    UNION ALL
    SELECT
        w.node,
        -- Without the folders in it, and no longer than a line has room for.
        coalesce(left(regexp_replace(u.command, '(^| )[^ ]*/', '\1', 'g'), 40), u.name, '?'),
        NULL, u.pid, u.cpu_ns,
        u.cpu_ns / (max(u.end_ns) OVER (PARTITION BY w.node)
            - min(u.start_ns) OVER (PARTITION BY w.node)),
        1, 'processes'
    FROM (SELECT DISTINCT node, host_id FROM waited) AS w
    JOIN main.program_usage AS u ON w.host_id = u.host_id
    WHERE list_contains($runs, u.run_id) AND NOT u.is_recorder
        AND u.end_ns > $start_ns AND u.start_ns < $end_ns
        AND NOT EXISTS (
            FROM waited AS o
            WHERE o.node = w.node AND o.process_id = u.process_id
        )
)
SELECT
    t.node,
    printf(
        '%s (%s)', t.name,
        CASE WHEN count(DISTINCT t.number) > 1
                THEN printf('%d %s', count(DISTINCT t.number), any_value(t.what))
            WHEN any_value(t.what) = 'processes' THEN printf('pid %d', any_value(t.number))
            ELSE any_value(t.number)::VARCHAR END
    ) AS program,
    t.reason,
    sum(t.used_cpus) AS used_cpus,
    any_value(h.cpus) AS cpus
FROM taken AS t
LEFT JOIN (
    SELECT
        w.node,
        max(u.cpus) AS cpus
    FROM waited AS w
    JOIN main.host_usage AS u ON w.host_id = u.host_id
    WHERE list_contains($runs, u.run_id)
    GROUP BY w.node
) AS h
    ON t.node = h.node
GROUP BY t.node, t.name, t.reason, t.place
QUALIFY row_number() OVER (
    PARTITION BY t.node ORDER BY t.place, sum(t.length_ns) DESC, t.name
) = 1
