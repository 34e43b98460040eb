-- title: The kernel trace does not show what woke threads
-- description: The kernel trace has switches alone. A sleep includes the wait for a CPU that
--     follows it, and what ended it is not known: there is no wake-up latency, and critical paths
--     end at sleeps.
-- cause: The event sched_waking was not recorded.
-- cure: Record sched_waking too (msgflow record --kernel; docs/scheduling.md has the commands).
-- grain: one row per run
-- severity: info
-- when: store.thread_state
SELECT
    run_id,
    count(*) AS count,
    printf('%d sleeps, and nothing woke a thread', count(*)) AS detail
FROM store.thread_state
WHERE state IN ('sleeping', 'uninterruptible')
    AND run_id NOT IN (SELECT run_id FROM store.thread_state WHERE state = 'runnable')
GROUP BY run_id
