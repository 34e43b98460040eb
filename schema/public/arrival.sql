-- description: When messages arrived, where the trace tells. With a kernel trace: the last waking
--     of the thread before it took the message. If it was awake when the message came, there is no
--     row. Exact where the take is the first thing that it did then, and a thread of the middleware
--     (by its name), the publishing thread, another ROS process or an interrupt woke it; any other
--     thread may have woken it for something else. Otherwise the hook of CARET in Fast DDS tells:
--     exact unless several readers of the process had the message. In an events executor, what its
--     own thread published came when publish() returned, other messages when the publishing thread
--     woke the middleware's (some 10 to 100 us before they were in the queue).
-- grain: one row per take whose publication is known, and before which its thread was woken or the
--     message seen to arrive
-- column: run_id
-- column: take_id BIGINT  Identity of the take
-- column: publication_id
-- column: arrived_ns BIGINT [epoch ns]  When the thread was woken, or the listener had the message
-- column: waker_kind VARCHAR  'thread', 'timer', 'interrupt' or 'softirq'; 'listener': it tells of
--     the message, not of the thread, which may have been busy (main.data_arrival)
-- column: waker_thread_id BIGINT  Thread of a ROS process that woke it, or that was interrupted
-- column: waker_name VARCHAR  Name of the thread that woke it, or that was interrupted
-- column: is_exact BOOLEAN  Nothing else explains the waking
-- column: until_arrival_ns BIGINT [ns]  From the end of the publication until then; negative:
--     before publish() returned
-- column: run_queue_ns BIGINT [ns]  From the waking until the thread had a CPU; NULL: not known
-- column: executor_ns BIGINT [ns]  From there until the take; with the two before it is the latency
WITH waking AS (
    SELECT
        s.thread_id,
        s.end_ns AS at_ns,
        s.waker_kind, s.waker_thread_id, s.waker_other_thread_id
    FROM main.thread_state AS s
    WHERE s.state = 'sleeping'
),
-- What a thread does has begun before it takes a message, unless that is all it woke for.
done AS (
    SELECT
        thread_id,
        taken_ns AS at_ns
    FROM main.take
    UNION ALL
    SELECT thread_id, start_ns
    FROM main.callback_instance
    UNION ALL
    SELECT thread_id, start_ns
    FROM main.publication
),
taken AS NOT MATERIALIZED (
    SELECT
        l.run_id, l.take_id, l.publication_id, t.thread_id, t.taken_ns, b.start_ns, b.end_ns,
        b.thread_id AS publishing_thread_id
    FROM main.link_transport AS l
    JOIN main.take AS t ON l.take_id = t.take_id
    JOIN main.publication AS b ON l.publication_id = b.publication_id
    WHERE l.latency_ns IS NOT NULL
),
woken AS (
    SELECT
        k.*,
        w.at_ns AS arrived_ns,
        w.waker_kind, w.waker_thread_id, w.waker_other_thread_id
    FROM (FROM taken WHERE thread_id IN (SELECT thread_id FROM main.thread_state)) AS k
    ASOF JOIN waking AS w ON k.thread_id = w.thread_id AND k.taken_ns >= w.at_ns
    WHERE w.at_ns >= k.start_ns AND w.waker_kind IS NOT NULL
),
behind AS (
    SELECT w.take_id, d.at_ns
    FROM woken AS w
    ASOF JOIN done AS d ON w.thread_id = d.thread_id AND w.taken_ns > d.at_ns
),
on_cpu AS (
    SELECT
        w.take_id,
        r.start_ns AS on_cpu_ns
    FROM woken AS w
    ASOF JOIN (SELECT * FROM main.thread_state WHERE state IN ('running', 'unknown')) AS r
        ON w.thread_id = r.thread_id AND w.arrived_ns <= r.start_ns
    WHERE r.state = 'running'
),
by_waking AS MATERIALIZED (
    SELECT
        w.run_id, w.take_id, w.publication_id, w.arrived_ns, w.waker_kind, w.waker_thread_id,
        coalesce(x.name, o.name) AS waker_name,
        coalesce(d.at_ns < w.arrived_ns, true) AND CASE w.waker_kind
            WHEN 'thread' THEN coalesce(
                w.waker_thread_id = w.publishing_thread_id OR x.process_id <> t.process_id
                OR regexp_matches(coalesce(x.name, o.name), '^(dds\.|recv|dq\.)'),
                false
            )
            ELSE w.waker_kind IN ('interrupt', 'softirq')
        END AS is_exact,
        w.arrived_ns - w.end_ns AS until_arrival_ns,
        c.on_cpu_ns - w.arrived_ns AS run_queue_ns,
        w.taken_ns - c.on_cpu_ns AS executor_ns
    FROM woken AS w
    JOIN main.thread AS t ON w.thread_id = t.thread_id
    LEFT JOIN main.thread AS x ON w.waker_thread_id = x.thread_id
    LEFT JOIN main.other_thread AS o ON w.waker_other_thread_id = o.other_thread_id
    LEFT JOIN behind AS d ON w.take_id = d.take_id
    LEFT JOIN on_cpu AS c ON w.take_id = c.take_id AND c.on_cpu_ns <= w.taken_ns
),
heard AS (
    SELECT
        k.run_id, k.take_id, k.publication_id,
        k.taken_ns - d.waited_ns AS arrived_ns,
        k.end_ns, d.waited_ns,
        NOT d.is_ambiguous AS is_exact
    FROM main.data_arrival AS d
    JOIN taken AS k ON d.take_id = k.take_id
    ANTI JOIN (SELECT take_id FROM by_waking WHERE is_exact) AS w ON d.take_id = w.take_id
)
SELECT
    run_id, take_id, publication_id, arrived_ns, waker_kind, waker_thread_id, waker_name, is_exact,
    until_arrival_ns, run_queue_ns, executor_ns
FROM by_waking
WHERE take_id NOT IN (SELECT take_id FROM heard)
UNION ALL
SELECT
    run_id, take_id, publication_id, arrived_ns, 'listener', NULL, NULL, is_exact,
    arrived_ns - end_ns,
    NULL, waited_ns
FROM heard
