-- What the kernel did, of a simulation: states of threads, what had the CPU while they waited for
-- one, how the time of callbacks divides, and when messages arrived. Truth is what the simulation
-- decided (the views simulated_…): it knows nothing of the events of a kernel trace. Where these
-- were lost, what is marked is not decided.
-- The truth has only threads with events of ROS.
CREATE OR REPLACE TEMP TABLE schedule_place AS
SELECT t.thread_id, t.name, h.hostname AS host, p.pid, t.tid
FROM analysed.store.thread AS t
JOIN analysed.store.process AS p ON t.process_id = p.process_id
JOIN analysed.store.host AS h ON p.host_id = h.host_id;

CREATE OR REPLACE TEMP TABLE truth_state AS
SELECT
    t.host, t.pid, t.tid, t.state, t.cpu, t.start_ns, t.end_ns,
    concat_ws(' ', t.waker_kind, t.waker_tid) AS waker,
    EXISTS (
        FROM simulated_kernel_loss AS l
        WHERE l.host = t.host AND l.end_ns > t.start_ns
            AND l.start_ns < coalesce(t.end_ns, l.end_ns)
    )
    -- Nothing comes after the last event.
    OR t.end_ns IS NULL AND t.start_ns >= r.last_ns AS is_lost
FROM simulated_thread_state AS t
JOIN schedule_place AS p ON t.host = p.host AND t.pid = p.pid AND t.tid = p.tid
JOIN (SELECT host, max(start_ns) AS last_ns FROM simulated_thread_state GROUP BY host) AS r
    ON t.host = r.host;

-- Of what perf loses, the trace does not tell.
CREATE OR REPLACE TEMP VIEW unmarked_loss AS
FROM simulated_kernel_loss
WHERE NOT is_counted;

CREATE OR REPLACE TEMP TABLE schedule_found AS
-- The last state of a thread goes on after the recording.
SELECT
    'thread_state' AS kind,
    concat_ws(' ', p.host, p.pid, p.tid, s.start_ns) AS key,
    concat_ws(
        ' ', s.state,
        CASE WHEN t.end_ns IS NOT NULL OR t.start_ns IS NULL THEN s.end_ns END,
        CASE WHEN s.state IN ('running', 'preempted') THEN s.cpu END,
        -- Of an interrupt, the waker is only what it interrupted.
        concat_ws(' ', s.waker_kind, CASE WHEN s.waker_kind = 'thread' THEN w.tid END)
    ) AS value,
    s.is_loss_affected OR EXISTS (
        FROM unmarked_loss AS l
        WHERE l.host = p.host AND l.end_ns >= s.start_ns AND l.start_ns <= s.end_ns
    ) AS is_marked
FROM analysed.store.thread_state AS s
JOIN schedule_place AS p ON s.thread_id = p.thread_id
LEFT JOIN schedule_place AS w ON s.waker_thread_id = w.thread_id
LEFT JOIN truth_state AS t
    ON p.host = t.host AND p.pid = t.pid AND p.tid = t.tid AND s.start_ns = t.start_ns
UNION ALL
SELECT
    'preemptor',
    concat_ws(' ', p.host, p.pid, p.tid, s.start_ns),
    concat_ws(' ', s.state, s.end_ns, coalesce(r.name, o.name), s.preemptor_priority),
    EXISTS (
        FROM simulated_kernel_loss AS l
        WHERE l.host = p.host AND l.end_ns >= s.start_ns AND l.start_ns <= s.end_ns
    )
    OR EXISTS (
        FROM truth_state AS t
        WHERE t.host = p.host AND t.pid = p.pid AND t.tid = p.tid AND t.end_ns IS NULL
            AND t.start_ns <= s.start_ns
    )
FROM analysed.store.preemptor AS s
JOIN schedule_place AS p ON s.thread_id = p.thread_id
LEFT JOIN schedule_place AS r ON s.preemptor_thread_id = r.thread_id
LEFT JOIN analysed.store.other_thread AS o ON s.preemptor_other_thread_id = o.other_thread_id
-- An idle CPU is nothing that the simulation does.
WHERE coalesce(s.preemptor_thread_id, s.preemptor_other_thread_id) IS NOT NULL
UNION ALL
SELECT
    'callback_schedule',
    concat_ws(' ', p.host, p.pid, p.tid, i.start_ns),
    concat_ws(
        ' ', s.running_ns, s.preempted_ns, s.runnable_ns, s.sleeping_ns, s.uninterruptible_ns,
        s.unknown_ns, s.irq_ns, s.softirq_ns, s.preemption_count
    ),
    -- A callback has a mark of its own where the trace lost one of its events.
    s.is_loss_affected OR i.is_loss_affected OR EXISTS (
        FROM unmarked_loss AS l
        WHERE l.host = p.host AND l.end_ns >= i.start_ns AND l.start_ns <= i.end_ns
    )
FROM analysed.store.callback_schedule AS s
JOIN analysed.store.callback_instance AS i ON s.callback_instance_id = i.callback_instance_id
JOIN schedule_place AS p ON i.thread_id = p.thread_id
UNION ALL
SELECT
    'arrival',
    concat_ws(' ', p.host, p.pid, p.tid, t.taken_ns),
    a.arrived_ns::VARCHAR,
    false
FROM analysed.main.arrival AS a
JOIN analysed.store.take AS t ON a.take_id = t.take_id
JOIN schedule_place AS p ON t.thread_id = p.thread_id
WHERE a.is_exact;

CREATE OR REPLACE TEMP TABLE schedule_truth AS
WITH handled AS (
    SELECT
        i.host, i.pid, i.tid, i.start_ns, n.kind,
        sum(
            least(n.end_ns, s.end_ns, i.end_ns) - greatest(n.start_ns, s.start_ns, i.start_ns)
        ) AS length_ns
    FROM simulated_callback_instance AS i
    JOIN truth_state AS s
        ON i.host = s.host AND i.pid = s.pid AND i.tid = s.tid AND s.end_ns > i.start_ns
            AND s.start_ns < i.end_ns
    JOIN simulated_interrupt AS n
        ON s.host = n.host AND s.cpu = n.cpu
            AND n.end_ns > greatest(s.start_ns, i.start_ns)
            AND n.start_ns < least(s.end_ns, i.end_ns)
    WHERE s.state = 'running'
    GROUP BY ALL
),
interrupted AS (
    SELECT
        host, pid, tid, start_ns,
        sum(length_ns) FILTER (WHERE kind = 'interrupt') AS irq_ns,
        sum(length_ns) FILTER (WHERE kind = 'softirq') AS softirq_ns
    FROM handled
    GROUP BY ALL
),
part AS (
    SELECT
        i.host, i.pid, i.tid, i.start_ns, s.state,
        sum(least(s.end_ns, i.end_ns) - greatest(s.start_ns, i.start_ns)) AS length_ns,
        count(*) FILTER (WHERE s.start_ns > i.start_ns) AS begun
    FROM simulated_callback_instance AS i
    JOIN truth_state AS s
        ON i.host = s.host AND i.pid = s.pid AND i.tid = s.tid AND s.end_ns > i.start_ns
            AND s.start_ns < i.end_ns
    GROUP BY ALL
),
ran AS (
    SELECT host, pid, tid, rmw_ns AS at_ns FROM simulated_take WHERE rmw_ns IS NOT NULL
    UNION ALL
    SELECT host, pid, tid, start_ns FROM simulated_callback_instance
)
SELECT
    'thread_state' AS kind, state AS label,
    concat_ws(' ', host, pid, tid, start_ns) AS key,
    concat_ws(
        ' ', state, end_ns, CASE WHEN state IN ('running', 'preempted') THEN cpu END,
        waker
    ) AS value,
    NOT is_lost AS is_decided
FROM truth_state
UNION ALL
SELECT
    'preemptor', s.state, concat_ws(' ', s.host, s.pid, s.tid, greatest(r.start_ns, s.start_ns)),
    concat_ws(' ', s.state, least(r.end_ns, s.end_ns), r.name, r.priority),
    NOT s.is_lost
FROM truth_state AS s
JOIN simulated_cpu_run AS r
    ON s.host = r.host AND s.cpu = r.cpu AND r.end_ns > s.start_ns AND r.start_ns < s.end_ns
WHERE s.state IN ('preempted', 'runnable')
UNION ALL
SELECT
    'callback_schedule', any_value(c.name),
    concat_ws(' ', i.host, i.pid, i.tid, i.start_ns),
    concat_ws(
        ' ',
        coalesce(sum(p.length_ns) FILTER (WHERE p.state = 'running'), 0),
        coalesce(sum(p.length_ns) FILTER (WHERE p.state = 'preempted'), 0),
        coalesce(sum(p.length_ns) FILTER (WHERE p.state = 'runnable'), 0),
        coalesce(sum(p.length_ns) FILTER (WHERE p.state = 'sleeping'), 0),
        coalesce(sum(p.length_ns) FILTER (WHERE p.state = 'uninterruptible'), 0),
        0,
        coalesce(any_value(n.irq_ns), 0),
        coalesce(any_value(n.softirq_ns), 0),
        coalesce(sum(p.begun) FILTER (WHERE p.state = 'preempted'), 0)
    ),
    NOT EXISTS (
        FROM simulated_kernel_loss AS l
        WHERE l.host = i.host AND l.end_ns > i.start_ns AND l.start_ns < i.end_ns
    )
FROM simulated_callback_instance AS i
JOIN part AS p
    ON i.host = p.host AND i.pid = p.pid AND i.tid = p.tid AND i.start_ns = p.start_ns
JOIN schedule_place AS c ON i.host = c.host AND i.pid = c.pid AND i.tid = c.tid
LEFT JOIN interrupted AS n
    ON i.host = n.host AND i.pid = n.pid AND i.tid = n.tid AND i.start_ns = n.start_ns
-- Whether callbacks are found, and their ends, other figures judge.
JOIN analysed.store.callback_instance AS f
    ON c.thread_id = f.thread_id AND i.start_ns = f.start_ns AND i.end_ns = f.end_ns
GROUP BY i.host, i.pid, i.tid, i.start_ns, i.end_ns
UNION ALL
SELECT
    'arrival', 'exact', concat_ws(' ', t.host, t.pid, t.tid, t.rmw_ns), a.arrived_ns::VARCHAR,
    -- It woke the thread, which took it first, and the link to its publication is decided.
    s.start_ns IS NOT NULL AND NOT s.is_lost AND l.to_id IS NOT NULL AND NOT EXISTS (
        FROM ran AS o
        WHERE o.host = t.host AND o.pid = t.pid AND o.tid = t.tid AND o.at_ns > a.arrived_ns
            AND o.at_ns < t.rmw_ns
    )
FROM simulated_arrival AS a
JOIN simulated_take AS t ON a.take_id = t.take_id
LEFT JOIN truth_link AS l
    ON l.kind = 'transport' AND l.to_id = t.take_id::VARCHAR AND l.is_decided
LEFT JOIN truth_state AS s
    ON t.host = s.host AND t.pid = s.pid AND t.tid = s.tid AND a.arrived_ns = s.start_ns
    AND s.state = 'runnable' AND s.waker = 'softirq';

CREATE OR REPLACE TEMP TABLE schedule_score AS
WITH found AS (
    SELECT f.kind, f.is_marked, t.key IS NOT NULL AS is_right
    FROM schedule_found AS f
    LEFT JOIN schedule_truth AS t ON f.kind = t.kind AND f.key = t.key AND f.value = t.value
),
expected AS (
    SELECT
        t.kind, count(*) AS happened, count(*) FILTER (WHERE t.is_decided) AS decided,
        count(*) FILTER (WHERE t.is_decided AND f.key IS NULL) AS missing
    FROM schedule_truth AS t
    LEFT JOIN schedule_found AS f ON t.kind = f.kind AND t.key = f.key AND t.value = f.value
    GROUP BY t.kind
),
counted AS (
    SELECT
        kind, count(*) AS found, count(*) FILTER (WHERE is_right) AS right_count,
        count(*) FILTER (WHERE NOT is_right AND NOT is_marked) AS wrong,
        count(*) FILTER (WHERE NOT is_right AND is_marked) AS misguessed
    FROM found
    GROUP BY kind
),
labelled AS (
    SELECT kind, string_agg(concat(label, ' ', number), ', ' ORDER BY label) AS labels
    FROM (SELECT kind, label, count(*) AS number FROM schedule_truth GROUP BY kind, label)
    GROUP BY kind
)
SELECT
    e.kind, e.happened, e.decided, coalesce(c.found, 0) AS found, coalesce(c.wrong, 0) AS wrong,
    0 AS loss_affected, coalesce(c.misguessed, 0) AS misguessed, 0 AS repeated, e.missing,
    0 AS doubted,
    coalesce(c.right_count / nullif(c.right_count + c.wrong, 0), 1) AS precision,
    coalesce(1 - e.missing / nullif(e.decided, 0), 1) AS recall,
    l.labels
FROM expected AS e
LEFT JOIN counted AS c ON e.kind = c.kind
LEFT JOIN labelled AS l ON e.kind = l.kind
ORDER BY e.kind;
