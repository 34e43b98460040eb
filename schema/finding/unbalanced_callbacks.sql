-- name: finding.unbalanced_callbacks
-- title: Callbacks without an end
-- description: Runs of callbacks have no end although their thread went on afterwards and no gap of
--     the trace explains it. Their durations are not known; what they published is still linked.
-- cause: The callback threw an exception that was caught further up, or the event callback_end is
--     not enabled.
-- cure: Enable ros2:callback_end; look at the callbacks (msgflow query callback-duration) for
--     exceptions.
-- grain: one row per process
-- severity: warning
-- needs: main.callback_instance, main.process, main.host, derive.counted
WITH last_start AS (
    SELECT thread_id, max(start_ns) AS start_ns
    FROM main.callback_instance
    GROUP BY thread_id
)
SELECT
    p.run_id,
    printf('%s %d on %s', coalesce(p.name, '?'), p.pid, h.hostname) AS subject,
    count(*) AS count,
    derive.counted(count(*), 'run') || ' of '
    || derive.counted(count(DISTINCT i.callback_id), 'callback') AS detail
FROM main.callback_instance AS i
JOIN last_start AS l ON i.thread_id = l.thread_id
JOIN main.process AS p ON i.process_id = p.process_id
JOIN main.host AS h ON p.host_id = h.host_id
WHERE i.end_ns IS NULL AND NOT i.is_loss_affected AND i.start_ns < l.start_ns
GROUP BY p.run_id, p.process_id, p.name, p.pid, h.hostname
