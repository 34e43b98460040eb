-- title: How long threads were ready without a CPU, by samples
-- description: Sums over a thread's stretches between two samples, so that those of any time are a
--     difference of two.
-- grain: one row per thread and stretch between two samples
-- when: main.thread_usage
-- column: thread_id BIGINT  Thread
-- column: start_ns BIGINT [epoch ns]  Begin of the stretch
-- column: end_ns BIGINT [epoch ns]  End of it
-- column: samples BIGINT  Stretches of the thread before this one
-- column: asleep BIGINT  Those of them at whose end it was asleep
-- column: disk BIGINT  Those of them at whose end it waited for a page or a disk
-- column: before_ns BIGINT [ns]  How long it was ready without a CPU before this one
-- column: waiting_ns BIGINT [ns]  How long in this one
SELECT
    thread_id, start_ns, end_ns,
    count(*) OVER before AS samples,
    count(*) FILTER (WHERE state <> 'R') OVER before AS asleep,
    count(*) FILTER (WHERE state = 'D') OVER before AS disk,
    (sum(waiting_ns) OVER thread - waiting_ns)::BIGINT AS before_ns,
    waiting_ns
FROM main.thread_usage
WHERE list_contains($runs, run_id)
WINDOW
    thread AS (PARTITION BY thread_id ORDER BY start_ns),
    before AS (
        PARTITION BY thread_id ORDER BY start_ns
        ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
    )
