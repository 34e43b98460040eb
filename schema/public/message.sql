-- name: main.message
-- description: Messages with the names of what they belong to: each reception of a message, with
--     its topic, the node that published it and the node that took it.
-- grain: one row per take
-- column: take_id BIGINT  Identity of the take
-- column: run_id BIGINT  Run that the row belongs to
-- column: topic_name VARCHAR  Topic; NULL: not known
-- column: publisher VARCHAR  Node that published, or its process in brackets; NULL: not known
-- column: subscriber VARCHAR  Node that took it, or its process in brackets
-- column: published_ns BIGINT [epoch ns]  Start of the publication; NULL: not known
-- column: taken_ns BIGINT [epoch ns]  Take
-- column: latency_ns BIGINT [ns]  From the end of the publication to the take
-- column: publication_id BIGINT  Publication; NULL: not known
-- column: candidate_count BIGINT  Publications that it may have been; more than 1: a guess
-- column: is_loss_affected BOOLEAN  A gap of the trace may have changed it
-- column: is_internal BOOLEAN  ROS uses the topic for itself
SELECT
    t.take_id,
    t.run_id,
    coalesce(s.topic_name, o.topic_name) AS topic_name,
    CASE WHEN b.publication_id IS NOT NULL THEN main.node_label(m.full_name, op.name, op.pid) END
        AS publisher,
    main.node_label(n.full_name, p.name, p.pid) AS subscriber,
    b.start_ns AS published_ns,
    t.taken_ns,
    l.latency_ns,
    l.publication_id,
    l.candidate_count,
    coalesce(l.is_loss_affected, t.is_loss_affected) AS is_loss_affected,
    coalesce(s.is_internal, o.is_internal, false) AS is_internal
FROM main.take AS t
LEFT JOIN main.subscription AS s ON t.subscription_id = s.subscription_id
LEFT JOIN main.node AS n ON s.node_id = n.node_id
JOIN main.process AS p ON t.process_id = p.process_id
LEFT JOIN main.link_transport AS l ON t.take_id = l.take_id
LEFT JOIN main.publication AS b ON l.publication_id = b.publication_id
LEFT JOIN main.publisher AS o ON b.publisher_id = o.publisher_id
LEFT JOIN main.node AS m ON o.node_id = m.node_id
LEFT JOIN main.process AS op ON b.process_id = op.process_id
