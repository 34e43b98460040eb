-- title: What executor threads spent their time on
-- description: Time of each executor thread by what it did (executor_activity): wait for work, look
--     for what is ready, take messages, run callbacks, or stand blocked until it gets the lock of a
--     multi-threaded executor. Meanwhile another thread may hold the lock and wait for work: then
--     the executor has nothing to do. These times add up to the time for which the thread was seen.
--     Only takes and callbacks are known of an executor without events of its own, or whose events
--     the recording leaves out. A thread of an events executor waits while it sleeps, where the
--     kernel was traced; else at least until the next message was published, or the next timer due,
--     and perhaps in the time that is not known.
-- grain: one row per executor thread
-- column: run_id, host, nodes, process, pid, tid
-- column: executor_kind VARCHAR     Kind of executor
-- column: seen_ns BIGINT [ns]       Time for which the thread was seen in the time window
-- column: wait_ns BIGINT [ns]       Waiting for work; in an events executor without a kernel trace:
--     for certain
-- column: select_ns BIGINT [ns]     Looking for what is ready; where a loop polls the executor
--     (spin_some; finding polled_executor), also what the loop does between two polls
-- column: take_ns BIGINT [ns]       Taking messages, up to the callback
-- column: callback_ns BIGINT [ns]   In callbacks, services included; nested time counts once. A
--     callback never seen to end lasts until the first event that cannot be inside it
-- column: blocked_ns BIGINT [ns]    Waiting for the lock of a multi-threaded executor
-- column: unknown_ns BIGINT [ns]    Not known: before the first event of the executor, in a gap of
--     the trace, or outside of callbacks where events of the executor are missing
-- column: longest_callback VARCHAR  The callback that kept the thread longest at one call, with its
--     node if the process has several; the first of equally long ones
-- column: longest_ns BIGINT [ns]    For how long within the time window, without what was nested in
--     it
-- column: callbacks BIGINT          Callbacks that began
-- column: callback_share DOUBLE [share] Callback time divided by time seen, 0 to 1
-- column: running_share DOUBLE [share]  Time on a CPU divided by the time for which msgflow record
--     sampled the thread; NULL: it did not
-- column: waiting_share DOUBLE [share]  Time ready without a CPU, likewise
-- column: executor_id, thread_id
-- brief: nodes, tid, callback_share, callback_ns, longest_ns, longest_callback, blocked_ns,
--     wait_ns, callbacks, running_share, waiting_share, select_ns, take_ns, process, pid, host,
--     seen_ns, unknown_ns, executor_kind
-- note: callbacks
WITH member AS (
    SELECT
        x.run_id, x.executor_id, x.thread_id, e.kind, t.tid, l.nodes, p.pid, p.name, h.hostname,
        greatest(t.first_seen_ns, $start_ns) AS first_ns,
        least(t.last_seen_ns, $end_ns) AS last_ns,
        x.thread_id IN (
            SELECT thread_id FROM main.executor_state WHERE list_contains($runs, run_id)
        ) AND x.run_id IN (
            SELECT run_id
            FROM main.executor_state
            WHERE list_contains($runs, run_id) AND state IN ('wait', 'process')
            GROUP BY run_id
            HAVING count(DISTINCT state) = 2
        ) AS has_states
    FROM main.executor_thread AS x
    JOIN main.executor AS e ON x.executor_id = e.executor_id
    JOIN main.thread AS t ON x.thread_id = t.thread_id
    JOIN main.process AS p ON t.process_id = p.process_id
    JOIN main.process_label AS l ON p.process_id = l.process_id
    JOIN main.host AS h ON p.host_id = h.host_id
    WHERE list_contains($runs, x.run_id)
),
broken AS (
    SELECT
        thread_id,
        max(resumed_ns) AS resumed_ns
    FROM main.thread_break
    WHERE list_contains($runs, run_id)
    GROUP BY thread_id
),
-- The last activity of a thread lasts until its last event; before a gap, its end is not known.
activity AS (
    SELECT
        a.thread_id, a.activity, a.callback_instance_id, a.start_ns,
        CASE
            WHEN a.end_ns IS NOT NULL THEN a.end_ns
            WHEN b.resumed_ns > a.start_ns THEN a.start_ns
            ELSE 9223372036854775807
        END AS end_ns
    FROM main.executor_activity_within($runs, $start_ns, $end_ns) AS a
    LEFT JOIN broken AS b ON a.thread_id = b.thread_id
),
spent AS (
    SELECT
        a.thread_id,
        CASE a.activity WHEN 'service' THEN 'callback' ELSE a.activity END AS activity,
        a.callback_instance_id,
        sum(greatest(least(a.end_ns, m.last_ns) - greatest(a.start_ns, m.first_ns), 0))::BIGINT
            AS duration_ns
    FROM activity AS a
    JOIN member AS m ON a.thread_id = m.thread_id
    GROUP BY ALL
),
summed AS (
    SELECT
        thread_id,
        coalesce(sum(duration_ns) FILTER (WHERE activity = 'wait'), 0)::BIGINT AS wait_ns,
        coalesce(sum(duration_ns) FILTER (WHERE activity = 'select'), 0)::BIGINT AS select_ns,
        coalesce(sum(duration_ns) FILTER (WHERE activity = 'take'), 0)::BIGINT AS take_ns,
        coalesce(sum(duration_ns) FILTER (WHERE activity = 'callback'), 0)::BIGINT AS callback_ns,
        coalesce(sum(duration_ns) FILTER (WHERE activity = 'blocked'), 0)::BIGINT AS blocked_ns,
        max({'duration_ns': duration_ns, 'earlier': -callback_instance_id})
            FILTER (WHERE activity = 'callback') AS longest,
        sum(duration_ns)::BIGINT AS known_ns
    FROM spent
    GROUP BY thread_id
),
callback AS (
    SELECT
        thread_id,
        count(*) AS callbacks
    FROM main.callback_instance
    WHERE list_contains($runs, run_id) AND start_ns >= $start_ns AND start_ns < $end_ns
    GROUP BY thread_id
),
-- Of a sample that the window cuts, a part counts.
sampled AS (
    SELECT
        thread_id, running_ns, waiting_ns,
        end_ns - start_ns AS length_ns,
        least(end_ns, $end_ns) - greatest(start_ns, $start_ns) AS inside_ns
    FROM main.thread_usage
    WHERE $has_usage
        AND list_contains($runs, run_id)
        AND end_ns > $start_ns
        AND start_ns < $end_ns
),
usage AS (
    SELECT
        thread_id,
        sum(running_ns::DOUBLE * inside_ns / length_ns) / sum(inside_ns) AS running_share,
        sum(waiting_ns::DOUBLE * inside_ns / length_ns) / sum(inside_ns) AS waiting_share
    FROM sampled
    GROUP BY thread_id
)
SELECT
    m.run_id,
    m.hostname AS host,
    m.nodes,
    m.name AS process,
    m.pid, m.tid,
    m.kind AS executor_kind,
    greatest(m.last_ns - m.first_ns, 0) AS seen_ns,
    CASE WHEN m.has_states OR m.kind = 'events' THEN coalesce(s.wait_ns, 0) END AS wait_ns,
    CASE WHEN m.has_states THEN coalesce(s.select_ns, 0) ELSE nullif(s.select_ns, 0) END
        AS select_ns,
    coalesce(s.take_ns, 0) AS take_ns,
    coalesce(s.callback_ns, 0) AS callback_ns,
    CASE WHEN m.has_states THEN coalesce(s.blocked_ns, 0) END AS blocked_ns,
    greatest(m.last_ns - m.first_ns, 0) - coalesce(s.known_ns, 0) AS unknown_ns,
    CASE WHEN l.node = m.nodes THEN l.label ELSE l.node || ' ' || l.label END AS longest_callback,
    s.longest.duration_ns AS longest_ns,
    coalesce(c.callbacks, 0) AS callbacks,
    coalesce(s.callback_ns, 0) / nullif(greatest(m.last_ns - m.first_ns, 0), 0)::DOUBLE
        AS callback_share,
    u.running_share, u.waiting_share, m.executor_id, m.thread_id
FROM member AS m
LEFT JOIN summed AS s ON m.thread_id = s.thread_id
LEFT JOIN callback AS c ON m.thread_id = c.thread_id
LEFT JOIN usage AS u ON m.thread_id = u.thread_id
LEFT JOIN main.callback_instance AS i ON i.callback_instance_id = -s.longest.earlier
LEFT JOIN main.callback_label AS l ON i.callback_id = l.callback_id
ORDER BY m.run_id, m.hostname, m.pid, m.tid, m.thread_id
