-- name: main.thread_schedule
-- kind: macro
-- description: How any interval of a thread divides into its states, as a kernel trace shows them.
--     The parts add up to the interval.
-- grain: one row
-- param: id BIGINT  Identity of the thread
-- param: from_ns BIGINT  Begin of the interval
-- param: until_ns BIGINT  End of the interval
-- column: running_ns BIGINT [ns]  On a CPU
-- column: preempted_ns BIGINT [ns]  Ready, but another thread had the CPU
-- column: runnable_ns BIGINT [ns]  Woken, waiting for a CPU
-- column: sleeping_ns BIGINT [ns]  Waiting for something
-- column: uninterruptible_ns BIGINT [ns]  Waiting for a page or a disk
-- column: unknown_ns BIGINT [ns]  Not known
CREATE OR REPLACE MACRO main.thread_schedule(id, from_ns, until_ns) AS TABLE
WITH part AS (
    SELECT state, least(end_ns, until_ns) - greatest(start_ns, from_ns) AS length_ns
    FROM main.thread_state
    WHERE thread_id = id AND end_ns > from_ns AND start_ns < until_ns
)
SELECT
    coalesce(sum(length_ns) FILTER (WHERE state = 'running'), 0)::BIGINT AS running_ns,
    coalesce(sum(length_ns) FILTER (WHERE state = 'preempted'), 0)::BIGINT AS preempted_ns,
    coalesce(sum(length_ns) FILTER (WHERE state = 'runnable'), 0)::BIGINT AS runnable_ns,
    coalesce(sum(length_ns) FILTER (WHERE state = 'sleeping'), 0)::BIGINT AS sleeping_ns,
    coalesce(sum(length_ns) FILTER (WHERE state = 'uninterruptible'), 0)::BIGINT
        AS uninterruptible_ns,
    (
        until_ns - from_ns - coalesce(sum(length_ns) FILTER (WHERE state <> 'unknown'), 0)
    )::BIGINT AS unknown_ns
FROM part
