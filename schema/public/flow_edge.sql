-- name: main.flow_edge
-- description: All links in one shape, with the times of both ends: cause and effect of every step
--     that a message takes.
-- grain: one row per link
-- column: run_id BIGINT  Run that the row belongs to
-- column: from_kind VARCHAR  Cause: 'publication', 'take' or 'callback_instance'
-- column: from_id BIGINT  Identity of the cause
-- column: to_kind VARCHAR  Effect, likewise
-- column: to_id BIGINT  Identity of the effect
-- column: link_kind VARCHAR  'transport', 'callback', or the kind of the causal link
-- column: from_ns BIGINT [epoch ns]  End of the publication, the take, or start of the callback run
-- column: to_ns BIGINT [epoch ns]  Take, start of the callback run, or start of the publication
-- needs: main.link_transport, main.link_causal, main.publication, main.take,
--     main.callback_instance
SELECT
    l.run_id,
    'publication' AS from_kind,
    l.publication_id AS from_id,
    'take' AS to_kind,
    l.take_id AS to_id,
    'transport' AS link_kind,
    b.end_ns AS from_ns,
    t.taken_ns AS to_ns
FROM main.link_transport AS l
JOIN main.publication AS b ON l.publication_id = b.publication_id
JOIN main.take AS t ON l.take_id = t.take_id
WHERE NOT l.is_self_loop
UNION ALL
SELECT
    i.run_id,
    'take',
    t.take_id,
    'callback_instance',
    i.callback_instance_id,
    'callback',
    t.taken_ns,
    i.start_ns
FROM main.callback_instance AS i
JOIN main.take AS t ON i.take_id = t.take_id
UNION ALL
SELECT
    l.run_id,
    CASE WHEN l.callback_instance_id IS NULL THEN 'take' ELSE 'callback_instance' END,
    coalesce(l.callback_instance_id, l.take_id),
    'publication',
    l.publication_id,
    l.kind,
    coalesce(i.start_ns, t.taken_ns),
    b.start_ns
FROM main.link_causal AS l
LEFT JOIN main.callback_instance AS i
    ON l.callback_instance_id = i.callback_instance_id
LEFT JOIN main.take AS t
    ON l.callback_instance_id IS NULL AND l.take_id = t.take_id
JOIN main.publication AS b ON l.publication_id = b.publication_id
