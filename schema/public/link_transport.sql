-- name: main.link_transport
-- description: Messages from publication to take. A negative latency means that the clocks of two
--     hosts are apart.
-- grain: one row per take whose publication is known
-- column: run_id
-- column: publication_id
-- column: take_id
-- column: method
-- column: candidate_count
-- column: is_self_loop
-- column: is_loss_affected
-- column: is_copy
-- column: latency_ns BIGINT [ns]  From the end of the publication to the take
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
