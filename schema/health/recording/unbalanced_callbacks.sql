-- name: finding.unbalanced_callbacks
-- title: Callbacks without an end
-- description: Callback instances have no end although their thread went on, and no gap in the
--     record of the thread explains it. Their durations are not known. What they published is still
--     linked.
-- cause: The callback threw an exception that was caught further up, or the event callback_end is
--     not enabled.
-- cure: Enable ros2:callback_end; look at the callbacks (msgflow query callback-duration) for
--     exceptions.
-- grain: one row per process
-- severity: warning
WITH run AS (
    SELECT
        *,
        max(start_ns) OVER (PARTITION BY thread_id) AS last_start_ns,
        lead(start_ns) OVER (PARTITION BY thread_id, callback_id ORDER BY start_ns)
            AS next_start_ns
    FROM main.callback_instance
),
open AS (
    SELECT *
    FROM run
    WHERE end_ns IS NULL AND NOT is_loss_affected AND start_ns < last_start_ns
),
-- Others may have run inside before the gap came that has the end.
cut AS (
    SELECT i.callback_instance_id
    FROM open AS i
    ASOF JOIN main.thread_break AS b ON i.thread_id = b.thread_id AND i.start_ns < b.resumed_ns
    WHERE coalesce(b.resumed_ns <= i.next_start_ns, i.next_start_ns IS NULL)
)
SELECT
    p.run_id,
    printf('%s %d on %s', coalesce(p.name, '?'), p.pid, h.hostname) AS subject,
    count(*) AS count,
    derive.counted(count(*), 'run') || ' of '
    || derive.counted(count(DISTINCT i.callback_id), 'callback') AS detail
FROM open AS i
ANTI JOIN cut AS c ON i.callback_instance_id = c.callback_instance_id
JOIN main.process AS p ON i.process_id = p.process_id
JOIN main.host AS h ON p.host_id = h.host_id
GROUP BY p.run_id, p.process_id, p.name, p.pid, h.hostname
