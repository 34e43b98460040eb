-- title: An executor that records no events
-- description: Threads ran callbacks one after the other, and no event of an executor, although
--     these events were enabled. What the threads did between callbacks is not known: they have no
--     executor states, and how long a message waited for them is bounded by callbacks only. Direct
--     links are not affected. Callbacks of Agnocast do not count: its executors have no events.
--     Nor do jobs of Python, which no executor runs, nor callbacks of a thread that was seen to
--     serve what came first first, as an events executor does: when it waited is known, at least
--     in part.
-- cause: rclcpp has no tracepoints in a StaticSingleThreadedExecutor, in a loop of the process that
--     calls callbacks itself (wait sets), and in an EventsExecutor. The recording shows an
--     EventsExecutor only if it has one thread and served enough messages.
-- cure: None needed. For executor states, use a SingleThreadedExecutor or MultiThreadedExecutor.
-- grain: one row per process with such threads
-- severity: warning
-- when: staging.callback_run WHERE thread_id NOT IN (SELECT thread_id FROM staging.executor_first)
WITH enabled AS (
    SELECT trace_index FROM staging.declared WHERE name = 'ros2:rclcpp_executor_get_next_ready'
),
silent AS (
    SELECT
        p.process_id, p.thread_id,
        count(*) AS number
    FROM staging.callback_run AS p
    SEMI JOIN enabled AS e ON p.trace_index = e.trace_index
    ANTI JOIN staging.executor_first AS x ON p.thread_id = x.thread_id
    ANTI JOIN staging.thread_break AS b ON p.thread_id = b.thread_id
    ANTI JOIN (FROM staging.queued_message WHERE is_in_order) AS o ON p.thread_id = o.thread_id
    ANTI JOIN (FROM staging.python_mark WHERE kind = 'job') AS m ON p.thread_id = m.thread_id
    -- Of these the recording left the events out.
    ANTI JOIN (SELECT process_id FROM staging.executor_named WHERE kind IN (
        'single_threaded_executor', 'multi_threaded_executor'
    )) AS n ON p.process_id = n.process_id
    WHERE NOT p.is_agnocast
    GROUP BY p.process_id, p.thread_id, p.trace_index
    -- An executor chose the first one before the recording began, perhaps. It would have said so
    -- before the next.
    HAVING count(*) > 1
),
running AS (
    SELECT
        process_id,
        count(DISTINCT thread_id) AS threads
    FROM staging.callback_run
    WHERE process_id IN (SELECT process_id FROM silent)
    GROUP BY process_id
)
SELECT
    s.process_id,
    sum(s.number)::BIGINT AS count,
    printf(
        '%d callbacks on %d of %d threads; what these did in between is not recorded',
        sum(s.number)::BIGINT, count(*), any_value(t.threads)
    ) AS detail
FROM silent AS s
JOIN running AS t ON s.process_id = t.process_id
GROUP BY s.process_id
