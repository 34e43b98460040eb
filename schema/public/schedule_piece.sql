-- description: What threads did in intervals, piece by piece, as a kernel trace shows it. A sleep
--     that another thread of a ROS process ended is replaced by what that thread did meanwhile, and
--     so on from waker to waker, until an interrupt or a thread of a process without ROS ends the
--     chain. The pieces add up to the interval.
-- grain: one row per piece of an interval
-- param: intervals VARCHAR  Name of rows of interval_id, thread_id, from_ns, to_ns: a table, or a
--     part of the query
-- param: runs
-- param: max_wakers INTEGER = 32  Longest chain of wakers
-- column: interval_id BIGINT  The interval
-- column: from_ns, to_ns
-- column: wakers BIGINT  How many wakers lead to the thread: 0 for that of the interval
-- column: thread_id BIGINT  The thread that did it
-- column: state VARCHAR  Its state, as in main.thread_state; 'unknown' also where the trace does
--     not cover it. NULL: nothing is known of the thread
-- column: priority INTEGER  Its priority, as the kernel has it
-- column: by_kind
-- column: by_thread_id, by_other_thread_id, by_priority
-- column: is_loss_affected BOOLEAN  Kernel events were lost meanwhile
CREATE OR REPLACE MACRO main.schedule_piece(intervals, runs, max_wakers := 32) AS TABLE
WITH RECURSIVE state AS MATERIALIZED (
    SELECT
        thread_id, start_ns, end_ns, state, priority,
        CASE
            WHEN is_cpu_idle THEN 'idle CPU'
            WHEN state = 'preempted' THEN 'thread'
            ELSE waker_kind
        END AS by_kind,
        -- Of an interrupt the waker is only what it interrupted.
        coalesce(
            preempted_by_thread_id, CASE WHEN waker_kind = 'thread' THEN waker_thread_id END
        ) AS by_thread_id,
        coalesce(
            preempted_by_other_thread_id,
            CASE WHEN waker_kind = 'thread' THEN waker_other_thread_id END
        ) AS by_other_thread_id,
        preempted_by_priority AS by_priority,
        is_loss_affected
    FROM main.thread_state
    WHERE list_contains(runs, run_id)
        AND end_ns > (SELECT min(from_ns) FROM query_table(intervals))
        AND start_ns < (SELECT max(to_ns) FROM query_table(intervals))
),
chain AS (
    SELECT
        i.interval_id,
        0::BIGINT AS wakers,
        greatest(s.start_ns, i.from_ns) AS from_ns,
        least(s.end_ns, i.to_ns) AS to_ns,
        s.*
    FROM query_table(intervals) AS i
    JOIN state AS s ON i.thread_id = s.thread_id AND s.end_ns > i.from_ns AND s.start_ns < i.to_ns
    UNION ALL
    SELECT
        c.interval_id,
        c.wakers + 1,
        greatest(s.start_ns, c.from_ns),
        least(s.end_ns, c.to_ns),
        s.*
    FROM chain AS c
    JOIN state AS s
        ON c.by_thread_id = s.thread_id AND s.end_ns > c.from_ns AND s.start_ns < c.to_ns
    WHERE c.state IN ('sleeping', 'uninterruptible')
        AND c.by_thread_id <> c.thread_id
        AND c.wakers < max_wakers
),
boundary AS (
    SELECT
        interval_id,
        from_ns AS at_ns
    FROM query_table(intervals)
    WHERE to_ns > from_ns
    UNION
    SELECT interval_id, from_ns
    FROM chain
    UNION
    SELECT c.interval_id, c.to_ns
    FROM chain AS c
    JOIN query_table(intervals) AS i ON c.interval_id = i.interval_id
    WHERE c.to_ns < i.to_ns
),
piece AS MATERIALIZED (
    SELECT
        i.interval_id, i.thread_id,
        b.at_ns AS from_ns,
        coalesce(lead(b.at_ns) OVER (PARTITION BY i.interval_id ORDER BY b.at_ns), i.to_ns) AS to_ns
    FROM boundary AS b
    JOIN query_table(intervals) AS i ON b.interval_id = i.interval_id
),
-- The states of one length of the chain follow each other: the longest chain tells most.
told AS (
    SELECT c.* REPLACE (p.from_ns AS from_ns)
    FROM (
        SELECT p.interval_id, p.from_ns, w.wakers
        FROM piece AS p
        JOIN (SELECT DISTINCT interval_id, wakers FROM chain) AS w
            ON p.interval_id = w.interval_id
    ) AS p
    ASOF JOIN chain AS c
        ON p.interval_id = c.interval_id AND p.wakers = c.wakers AND p.from_ns >= c.from_ns
    WHERE c.to_ns > p.from_ns
    QUALIFY row_number() OVER (PARTITION BY p.interval_id, p.from_ns ORDER BY c.wakers DESC) = 1
)
SELECT
    p.interval_id, p.from_ns, p.to_ns,
    coalesce(t.wakers, 0) AS wakers,
    coalesce(t.thread_id, p.thread_id) AS thread_id,
    coalesce(
        t.state,
        -- Also of a thread whose states are all at other times.
        CASE WHEN p.thread_id IN (SELECT thread_id FROM store.thread_state) THEN 'unknown' END
    ) AS state,
    t.priority, t.by_kind, t.by_thread_id, t.by_other_thread_id, t.by_priority,
    coalesce(t.is_loss_affected, false) AS is_loss_affected
FROM piece AS p
LEFT JOIN told AS t ON p.interval_id = t.interval_id AND p.from_ns = t.from_ns
