-- name: call
-- description: Requests and responses of services as bars, from sending to taking. Each end has the
--     clock of another thread, so that times are corrected ones.
-- grain: one row per request and per response
-- kind: inline
-- column: run_id BIGINT  Run
-- column: row_key BIGINT  Row of the timeline: the client, else the service, else the process
-- column: kind UTINYINT  3 request, 4 response
-- column: id BIGINT  Identity of the request or response
-- column: start_ns BIGINT [epoch ns]  Sending; taking where that is all there is
-- column: end_ns BIGINT [epoch ns]  Taking; sending where that is all there is
-- column: flags UTINYINT  2: one of the two was not seen
SELECT
    q.run_id,
    coalesce(8 * q.client_id + 3, 8 * q.service_id + 2, 8 * t.process_id + 7) AS row_key,
    3::UTINYINT AS kind,
    q.request_id AS id,
    coalesce(q.sent_ns, q.taken_ns) AS start_ns,
    coalesce(q.taken_ns, q.sent_ns) AS end_ns,
    (2 * (q.taken_ns IS NULL OR q.sent_ns IS NULL)::UTINYINT)::UTINYINT AS flags
FROM main.request AS q
JOIN main.thread AS t ON coalesce(q.sender_thread_id, q.receiver_thread_id) = t.thread_id
UNION ALL
SELECT
    r.run_id,
    coalesce(8 * r.client_id + 3, 8 * r.service_id + 2, 8 * t.process_id + 7),
    4,
    r.response_id,
    coalesce(r.sent_ns, r.taken_ns),
    coalesce(r.taken_ns, r.sent_ns),
    (2 * (r.taken_ns IS NULL OR r.sent_ns IS NULL)::UTINYINT)::UTINYINT
FROM main.response AS r
JOIN main.thread AS t ON coalesce(r.receiver_thread_id, r.sender_thread_id) = t.thread_id
