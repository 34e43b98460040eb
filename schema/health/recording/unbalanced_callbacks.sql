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
    SELECT callback_id, process_id, thread_id, start_ns
    FROM main.callback_instance
    WHERE end_ns IS NULL AND NOT is_loss_affected
),
last AS (
    SELECT thread_id, max(start_ns) AS start_ns
    FROM main.callback_instance
    WHERE thread_id IN (SELECT thread_id FROM unended)
    GROUP BY thread_id
)
SELECT
    p.run_id,
    printf('%s %d on %s', coalesce(p.name, '?'), p.pid, h.hostname) AS subject,
    count(*) AS count,
    derive.counted(count(*), 'run') || ' of '
    || derive.counted(count(DISTINCT i.callback_id), 'callback') AS detail
FROM unended AS i
JOIN last AS l ON i.thread_id = l.thread_id AND i.start_ns < l.start_ns
JOIN main.process AS p ON i.process_id = p.process_id
JOIN main.host AS h ON p.host_id = h.host_id
GROUP BY p.run_id, p.process_id, p.name, p.pid, h.hostname
