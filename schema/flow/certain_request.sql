-- description: Requests that callback instances sent, as flows follow them. What goes on for a
--     response follows from that (derive.certain_call). Where several processes with equal ids
--     cannot be told apart, a callback of another one may have sent them: these are left out.
-- grain: one row per such request that is followed
SELECT l.run_id, l.request_id, l.callback_instance_id
FROM store.link_request AS l
ANTI JOIN (
    SELECT q.request_id
    FROM store.request AS q
    JOIN store.thread AS h ON q.sender_thread_id = h.thread_id
    JOIN store.process AS p ON h.process_id = p.process_id
    WHERE p.is_ambiguous
) AS m ON l.request_id = m.request_id
ANTI JOIN (FROM store.link_call WHERE request_id IS NOT NULL) AS c ON l.request_id = c.request_id
WHERE l.callback_instance_id IS NOT NULL
