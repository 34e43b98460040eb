-- title: Kernel events were lost
-- description: Kernel events are missing, on any CPU. States of threads meanwhile are marked
--     is_loss_affected: a switch or a waking in them may not be seen.
-- cause: The buffers of the kernel trace were full, or it was written too slowly.
-- cure: Record with larger buffers (lttng enable-channel --kernel --subbuf-size; perf record -m),
--     or fewer events.
-- grain: one row per run
-- severity: warning
-- when: store.thread_state
WITH state AS (
    SELECT
        run_id,
        count(*) AS states,
        count(*) FILTER (WHERE is_loss_affected) AS affected
    FROM store.thread_state
    GROUP BY run_id
),
callback AS (
    SELECT
        run_id,
        count(*) FILTER (WHERE is_loss_affected) AS affected
    FROM store.callback_schedule
    GROUP BY run_id
)
SELECT
    s.run_id,
    s.affected AS count,
    printf(
        '%d of %s of threads, %s', s.affected, derive.counted(s.states, 'state'),
        derive.counted(coalesce(c.affected, 0), 'callback instance')
    ) AS detail
FROM state AS s
LEFT JOIN callback AS c ON s.run_id = c.run_id
WHERE s.affected > 0
