-- description: Messages with the names of what they belong to: every published message, once for
--     each subscription that took it. A message that none took is a row without a take
--     (main.stat_delivery says why), one whose publication is not known a row without a
--     publication.
-- grain: one row per publication and take of it; one per publication or take without the other
-- column: take_id BIGINT  Take; NULL: no subscription took the message
-- column: run_id
-- column: topic_name VARCHAR  Topic; NULL: not known
-- column: publisher VARCHAR  Node that published, or its process in brackets; NULL: not known
-- column: subscriber VARCHAR  Node that took it, or its process in brackets; NULL: none
-- column: published_ns BIGINT [epoch ns]  Start of the publication; NULL: not known
-- column: taken_ns BIGINT [epoch ns]  Take; NULL: none
-- column: latency_ns BIGINT [ns]  From the end of the publication to the take; NULL: not known
-- column: publication_id BIGINT  Publication; NULL: not known
-- column: candidate_count BIGINT  Publications that it may have been; more than 1: a guess; NULL:
--     no publication is known, or no take
-- column: is_loss_affected BOOLEAN  A gap of the trace may have changed it
-- column: is_internal BOOLEAN  ROS uses the topic for itself; or the middleware sent the message
--     for itself, past rcl
SELECT
    t.take_id,
    coalesce(t.run_id, b.run_id) AS run_id,
    coalesce(s.topic_name, o.topic_name) AS topic_name,
    CASE WHEN b.publication_id IS NOT NULL THEN main.node_label(m.full_name, op.name, op.pid) END
        AS publisher,
    CASE WHEN t.take_id IS NOT NULL THEN main.node_label(n.full_name, p.name, p.pid) END
        AS subscriber,
    b.start_ns AS published_ns,
    t.taken_ns, l.latency_ns, b.publication_id, l.candidate_count,
    coalesce(l.is_loss_affected, t.is_loss_affected, b.is_loss_affected) AS is_loss_affected,
    coalesce(
        s.is_internal, o.is_internal,
        t.take_id IS NULL AND coalesce(b.intra_ns, b.rclcpp_ns, b.rcl_ns, b.publisher_id) IS NULL
    ) AS is_internal
FROM main.take AS t
LEFT JOIN main.subscription AS s ON t.subscription_id = s.subscription_id
LEFT JOIN main.node AS n ON s.node_id = n.node_id
LEFT JOIN main.process AS p ON t.process_id = p.process_id
LEFT JOIN main.link_transport AS l ON t.take_id = l.take_id
FULL JOIN main.publication AS b ON l.publication_id = b.publication_id
LEFT JOIN main.publisher AS o ON b.publisher_id = o.publisher_id
LEFT JOIN main.node AS m ON o.node_id = m.node_id
LEFT JOIN main.process AS op ON b.process_id = op.process_id
