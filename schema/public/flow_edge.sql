-- description: All links in one shape, with the times of both ends: cause and effect of every step
--     that a message takes.
-- grain: one row per cause, effect and kind of link, however many annotations declare it
-- column: run_id
-- column: from_kind VARCHAR  Cause: 'publication', 'take', 'callback_instance', 'request' or
--     'response'
-- column: from_id
-- column: to_kind VARCHAR  Effect: one of these
-- column: to_id BIGINT  Identity of the effect
-- column: link_kind VARCHAR  'transport', 'callback', 'service' (from a request to its response),
--     or the kind of the causal link
-- column: from_ns BIGINT [epoch ns]  End of the publication, the take (also of a request or
--     response), or start of the callback instance
-- column: to_ns BIGINT [epoch ns]  Take, start of the callback instance or publication, or sending
--     of the request or response
WITH moment AS (
    -- When each thing was: as a cause, and as an effect.
    SELECT
        'publication' AS kind,
        publication_id AS id,
        end_ns AS from_ns,
        start_ns AS to_ns
    FROM main.publication
    UNION ALL
    SELECT 'take', take_id, taken_ns, taken_ns FROM main.take
    UNION ALL
    SELECT 'callback_instance', callback_instance_id, start_ns, start_ns FROM main.callback_instance
    UNION ALL
    SELECT
        'request', request_id,
        coalesce(taken_ns, sent_ns),
        sent_ns
    FROM main.request
    UNION ALL
    SELECT
        'response', response_id, taken_ns,
        coalesce(sent_ns, taken_ns)
    FROM main.response
)
SELECT l.run_id, l.from_kind, l.from_id, l.to_kind, l.to_id, l.link_kind, f.from_ns, t.to_ns
FROM derive.flow_link AS l
JOIN moment AS f ON l.from_kind = f.kind AND l.from_id = f.id
JOIN moment AS t ON l.to_kind = t.kind AND l.to_id = t.id
