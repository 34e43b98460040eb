-- title: What has the CPU for which callbacks wait
-- description: By program: how long its threads had the CPU while threads of callbacks were ready.
-- grain: one row per node of a thread that waited, the worst program alone
-- when: main.thread_state
-- reads: callback_name
-- column: node VARCHAR  Node whose thread waited
-- column: program VARCHAR  Name of what had the CPU longest, and its pid or thread, or how many
--     threads of that name it were
WITH waited AS (
    SELECT DISTINCT l.node, i.thread_id
    FROM main.callback_instance AS i
    JOIN callback_name AS l ON i.callback_id = l.callback_id
    WHERE list_contains($runs, i.run_id)
),
taken AS (
    SELECT
        w.node,
        coalesce(r.name, o.name, '?') AS name,
        coalesce(h.tid, o.tid) AS number,
        p.end_ns - p.start_ns AS length_ns
    FROM waited AS w
    JOIN main.preemptor AS p ON w.thread_id = p.thread_id
    LEFT JOIN main.thread AS h ON p.preemptor_thread_id = h.thread_id
    LEFT JOIN main.process AS r ON h.process_id = r.process_id
    LEFT JOIN main.other_thread AS o ON p.preemptor_other_thread_id = o.other_thread_id
    WHERE p.start_ns >= $start_ns AND p.start_ns < $end_ns
        -- An idle CPU is not taken, and what records is gone without it.
        AND coalesce(o.tid <> 0, true)
        AND NOT coalesce(regexp_full_match(o.name, 'lttng-.*|msgflow|perf'), false)
)
SELECT
    node,
    printf(
        '%s (%s)', name,
        CASE WHEN count(DISTINCT number) > 1 THEN printf('%d threads', count(DISTINCT number))
            ELSE any_value(number)::VARCHAR END
    ) AS program
FROM taken
GROUP BY node, name
QUALIFY row_number() OVER (PARTITION BY node ORDER BY sum(length_ns) DESC, name) = 1
