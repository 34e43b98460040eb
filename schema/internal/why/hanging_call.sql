-- title: Callbacks that never end
-- description: With the request that is the last that their threads did, if it is. The execution of
--     a goal may take longer than the recording, and so may what runs for the first time, unless it
--     waits for an answer. A coroutine that awaits one has no thread: its callback never ran again.
-- grain: one row per thread, or coroutine
-- reads: callback_name, callback_use
-- next: flow --callback-instance {callback_instance_id}
-- column: node VARCHAR  Node
-- column: callback VARCHAR  What triggers it
-- column: function VARCHAR  Its function, without its module; NULL: not known
-- column: callback_instance_id BIGINT  The instance that does not end
-- column: open_ns BIGINT [ns]  From its start to the end of the recording
-- column: service_name VARCHAR  Service that the request is to; NULL: it did something else last
-- column: is_answered BOOLEAN  The answer was sent, though not taken
-- column: is_own BOOLEAN  The service is of its process
SELECT
    n.node, n.callback, n.function, i.callback_instance_id,
    r.end_ns - i.start_ns AS open_ns,
    q.service_name,
    q.response_id IS NOT NULL AS is_answered,
    q.is_own
FROM main.finding AS f
JOIN main.callback_instance AS i ON f.thread_id = i.thread_id AND i.end_ns IS NULL
JOIN callback_name AS n ON i.callback_id = n.callback_id
JOIN main.callback AS c ON i.callback_id = c.callback_id
JOIN main.run AS r ON f.run_id = r.run_id
LEFT JOIN derive.last_request AS q ON i.callback_instance_id = q.callback_instance_id
WHERE list_contains($runs, f.run_id) AND f.name = 'hanging_callback'
    AND c.kind <> 'action'
    AND (
        q.callback_instance_id IS NOT NULL
        OR EXISTS (
            FROM main.callback_instance AS o
            WHERE o.callback_id = i.callback_id AND o.end_ns IS NOT NULL
        )
    )
QUALIFY row_number() OVER (PARTITION BY f.thread_id ORDER BY i.start_ns DESC) = 1
UNION ALL
SELECT
    n.node, n.callback, n.function, l.callback_instance_id,
    p.end_ns - q.sent_ns,
    c.service_name, false, false
FROM main.request AS q
ANTI JOIN main.response AS a ON q.request_id = a.request_id
JOIN main.link_request AS l ON q.request_id = l.request_id
JOIN main.callback_instance AS i ON l.callback_instance_id = i.callback_instance_id
JOIN callback_name AS n ON i.callback_id = n.callback_id
JOIN callback_use AS u
    ON n.node = u.node AND n.callback = u.callback AND q.sent_ns >= u.last_ns
JOIN main.client AS c ON q.client_id = c.client_id
-- Until its process ran a callback for the last time: what ends with its program does not hang.
JOIN (
    SELECT
        process_id,
        max(start_ns) AS end_ns
    FROM main.callback_instance
    WHERE list_contains($runs, run_id)
    GROUP BY process_id
) AS p
    ON c.process_id = p.process_id
JOIN (
    SELECT
        service_name,
        max(returned_ns - sent_ns) AS longest_ns
    FROM main.waited_call
    WHERE $has_calls AND is_awaited AND list_contains($runs, run_id)
    GROUP BY service_name
) AS w
    ON c.service_name = w.service_name AND p.end_ns - q.sent_ns > 3 * w.longest_ns
WHERE list_contains($runs, q.run_id) AND i.end_ns IS NOT NULL
