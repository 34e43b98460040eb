-- name: main.link_transport
-- description: Messages from publication to take. A negative latency means that the clocks of two
--     hosts are apart.
-- grain: one row per take whose publication is known
-- column: run_id BIGINT  Run that the row belongs to
-- column: publication_id BIGINT  Where the message came from
-- column: take_id BIGINT  Where it was received
-- column: method VARCHAR  'exact', 'exact_stamp', 'nearest' or 'ring_buffer'
-- column: candidate_count BIGINT  Number of publications that are possible
-- column: is_self_loop BOOLEAN  Received by the publishing node itself
-- column: is_loss_affected BOOLEAN  A gap of the trace may hide a better partner
-- column: is_copy BOOLEAN  A ring buffer carries the same message: no callback gets this one
-- column: latency_ns BIGINT [ns]  From the end of the publication to the take
-- needs: store.link_transport, main.publication, main.take
SELECT
    l.run_id,
    l.publication_id,
    l.take_id,
    l.method,
    l.candidate_count,
    l.is_self_loop,
    l.is_loss_affected,
    l.is_copy,
    t.taken_ns - b.end_ns AS latency_ns
FROM store.link_transport AS l
JOIN main.publication AS b ON l.publication_id = b.publication_id
JOIN main.take AS t ON l.take_id = t.take_id
