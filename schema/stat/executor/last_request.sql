-- description: Requests without an answer that threads sent last, in a callback that hangs.
--     `response_id`: the answer that was sent, though not taken. `is_own`: the service is of that
--     process.
-- grain: one row per thread that hangs since it sent a request
SELECT
    h.callback_instance_id, c.service_name,
    a.response_id,
    EXISTS (
        FROM store.service AS v
        WHERE c.service_name = v.service_name AND h.process_id = v.process_id
    ) AS is_own
FROM derive.hanging_callback AS h
JOIN store.link_request AS l ON h.callback_instance_id = l.callback_instance_id
JOIN store.request AS q ON l.request_id = q.request_id
JOIN store.client AS c ON q.client_id = c.client_id
LEFT JOIN store.response AS a ON q.request_id = a.request_id
JOIN store.thread AS t ON h.thread_id = t.thread_id
WHERE q.sent_ns >= t.last_seen_ns AND a.taken_ns IS NULL
QUALIFY row_number() OVER (PARTITION BY h.callback_instance_id ORDER BY a.sent_ns) = 1
