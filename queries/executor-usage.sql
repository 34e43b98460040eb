-- name: executor-usage
-- title: What executor threads spent their time on
-- description: Time of each executor thread in the three states that its events show (waiting for
--     work, looking for what is ready, executing), and in callbacks. An executor without such
--     events (events executor, static executor, rclpy) has callback time only. The callback share
--     is the share of the time for which the thread was seen.
-- grain: one row per executor thread
-- column: run_id BIGINT             Run
-- column: host VARCHAR [host]  Host
-- column: process VARCHAR           Process name
-- column: pid INTEGER               Process id
-- column: tid INTEGER               Thread id
-- column: executor_kind VARCHAR     Kind of executor
-- column: seen_ns BIGINT [ns]       Time for which the thread was seen in the time window
-- column: wait_ns BIGINT [ns]       Waiting for work
-- column: process_ns BIGINT [ns]    Looking for what is ready; where a loop polls the executor
--     (spin_some; finding polled_executor), also what the loop does between two polls
-- column: execute_ns BIGINT [ns]    Executing, including taking messages; in a multi-threaded
--     executor also blocked behind a callback until it may look for work again
-- column: callback_ns BIGINT [ns]   In callbacks with an end; nested time counts once
-- column: callbacks BIGINT          Callbacks that began
-- column: callback_share DOUBLE [share] Callback time divided by time seen, 0 to 1
-- column: executor_id BIGINT        Identity of the executor
-- column: thread_id BIGINT          Identity of the thread
-- brief: process, tid, callback_share, callback_ns, callbacks, host, execute_ns, wait_ns, seen_ns,
--     executor_kind, pid, process_ns
WITH member AS (
    SELECT
        x.run_id, x.executor_id, x.thread_id, e.kind, t.tid, p.pid, p.name, h.hostname,
        greatest(t.first_seen_ns, $start_ns) AS first_ns,
        least(t.last_seen_ns, $end_ns) AS last_ns
    FROM main.executor_thread AS x
    JOIN main.executor AS e ON x.executor_id = e.executor_id
    JOIN main.thread AS t ON x.thread_id = t.thread_id
    JOIN main.process AS p ON t.process_id = p.process_id
    JOIN main.host AS h ON p.host_id = h.host_id
    WHERE list_contains($runs, x.run_id)
),
last_state AS (
    SELECT thread_id, max(start_ns) AS start_ns
    FROM main.executor_state
    WHERE list_contains($runs, run_id)
    GROUP BY thread_id
),
-- The last state of a thread lasts until its last event; before a gap, its end is not known.
in_state AS (
    SELECT
        m.thread_id,
        s.state,
        greatest(
            least(coalesce(s.end_ns, m.last_ns), m.last_ns)
            - greatest(s.start_ns, m.first_ns),
            0
        ) AS duration_ns
    FROM member AS m
    JOIN main.executor_state AS s ON m.thread_id = s.thread_id
    JOIN last_state AS l ON m.thread_id = l.thread_id
    WHERE s.end_ns IS NOT NULL OR l.start_ns = s.start_ns
),
state AS (
    SELECT
        thread_id,
        sum(CASE WHEN state = 'wait' THEN duration_ns ELSE 0 END)::BIGINT AS wait_ns,
        sum(CASE WHEN state = 'process' THEN duration_ns ELSE 0 END)::BIGINT AS process_ns,
        sum(CASE WHEN state = 'execute' THEN duration_ns ELSE 0 END)::BIGINT AS execute_ns
    FROM in_state
    GROUP BY thread_id
),
callback AS (
    SELECT
        m.thread_id,
        count(*) FILTER (WHERE i.start_ns >= $start_ns AND i.start_ns < $end_ns) AS callbacks,
        sum(
            greatest(least(i.end_ns, m.last_ns) - greatest(i.start_ns, m.first_ns), 0)
        ) FILTER (WHERE i.parent_id IS NULL AND i.end_ns IS NOT NULL)::BIGINT AS callback_ns
    FROM member AS m
    JOIN main.callback_instance AS i ON m.thread_id = i.thread_id
    GROUP BY m.thread_id
)
SELECT
    m.run_id,
    m.hostname AS host,
    m.name AS process,
    m.pid,
    m.tid,
    m.kind AS executor_kind,
    greatest(m.last_ns - m.first_ns, 0) AS seen_ns,
    s.wait_ns,
    s.process_ns,
    s.execute_ns,
    coalesce(c.callback_ns, 0) AS callback_ns,
    coalesce(c.callbacks, 0) AS callbacks,
    coalesce(c.callback_ns, 0) / nullif(greatest(m.last_ns - m.first_ns, 0), 0)::DOUBLE
        AS callback_share,
    m.executor_id,
    m.thread_id
FROM member AS m
LEFT JOIN state AS s ON m.thread_id = s.thread_id
LEFT JOIN callback AS c ON m.thread_id = c.thread_id
ORDER BY m.run_id, m.hostname, m.pid, m.tid, m.thread_id
