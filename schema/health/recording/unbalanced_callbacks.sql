-- title: Callbacks without an end
-- description: Callback instances have no end although their thread went on, and no gap in the
--     record of the thread explains it. Their durations are not known. What they published is still
--     linked.
-- cause: The callback threw an exception that was caught further up, or the event callback_end is
--     not enabled; or it is of a service that answers later, before Kilted, in an executor that has
--     no events.
-- cure: Enable ros2:callback_end; look at the callbacks (msgflow query callbacks) for exceptions.
-- grain: one row per process
-- severity: warning
-- when: store.callback_instance WHERE end_ns IS NULL
WITH unended AS (
    SELECT run_id, callback_instance_id, callback_id, process_id, thread_id, start_ns
    FROM main.callback_instance
    WHERE end_ns IS NULL AND NOT is_loss_affected
),
near AS (
    SELECT thread_id, callback_id, start_ns
    FROM main.callback_instance
    WHERE thread_id IN (SELECT thread_id FROM unended)
),
last AS (
    SELECT
        thread_id,
        max(start_ns) AS start_ns
    FROM near
    GROUP BY thread_id
),
open AS (
    SELECT u.*
    FROM unended AS u
    JOIN last AS l ON u.thread_id = l.thread_id AND u.start_ns < l.start_ns
),
-- Others may have run inside before the gap came that has the end.
cut AS (
    SELECT i.callback_instance_id
    FROM open AS i
    ASOF JOIN main.thread_break AS b ON i.thread_id = b.thread_id AND i.start_ns < b.resumed_ns
    ASOF LEFT JOIN near AS n
        ON i.thread_id = n.thread_id AND i.callback_id = n.callback_id AND i.start_ns < n.start_ns
    WHERE coalesce(b.resumed_ns <= n.start_ns, n.start_ns IS NULL)
)
SELECT
    i.run_id, i.process_id,
    count(*) AS count,
    derive.counted(count(*), 'run') || ' of '
    || derive.counted(count(DISTINCT i.callback_id), 'callback') AS detail
FROM open AS i
ANTI JOIN cut AS c ON i.callback_instance_id = c.callback_instance_id
GROUP BY i.run_id, i.process_id
