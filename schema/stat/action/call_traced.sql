-- name: derive.call_traced
-- description: Processes whose requests and responses have events in a trace of their host. Where
--     none was seen, there was none.
-- grain: one row per such process
SELECT DISTINCT p.process_id
FROM store.process AS p
JOIN store.trace AS t ON p.host_id = t.host_id
WHERE t.has_request_events
