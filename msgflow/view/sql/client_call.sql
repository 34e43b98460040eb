-- description: Calls of one client of a service.
-- grain: one row per request
-- kind: inline
-- column: request_id BIGINT  Identity of the request
-- column: at_ns BIGINT [epoch ns]  When it was sent, or where that is not known, taken
-- column: round_trip BIGINT [ns]  Until the response was taken; NULL: not known
SELECT
    q.request_id,
    coalesce(q.sent_ns, q.taken_ns) AS at_ns,
    min(r.taken_ns) - q.sent_ns AS round_trip
FROM main.request AS q
LEFT JOIN main.response AS r ON q.request_id = r.request_id
WHERE q.run_id = $run AND q.client_id IS NOT DISTINCT FROM $client
GROUP BY q.request_id, q.sent_ns, q.taken_ns
