-- description: Messages from publication to take. A negative latency means that the clocks of two
--     hosts are apart.
-- grain: one row per take whose publication is known
-- column: run_id, publication_id, take_id, method, candidate_count, is_self_loop, is_loss_affected,
--     is_copy
-- column: latency_ns BIGINT [ns]  From the end of the publication to the take; NULL: the message
--     was stored
-- column: stored_ns BIGINT [ns]  How long it was stored: from the end of the publication until its
--     subscription existed, which then read it; NULL: it was not
SELECT
    l.run_id, l.publication_id, l.take_id, l.method, l.candidate_count, l.is_self_loop,
    l.is_loss_affected, l.is_copy,
    CASE WHEN z.take_id IS NULL THEN t.taken_ns - b.end_ns END AS latency_ns,
    z.stored_ns
FROM store.link_transport AS l
JOIN main.publication AS b ON l.publication_id = b.publication_id
JOIN main.take AS t ON l.take_id = t.take_id
LEFT JOIN derive.stored_take AS z ON l.take_id = z.take_id
