-- description: The number that Agnocast gave each message. It counts the messages of one topic on
--     one kernel.
-- grain: one row per publication or take of Agnocast
-- when: raw.agnocast_agnocast_publish, raw.agnocast_agnocast_create_callable,
--     raw.agnocast_agnocast_take
SELECT
    n.publication_id,
    NULL::BIGINT AS take_id,
    b.entry_id, b.event_id
FROM raw.agnocast_agnocast_publish AS b
JOIN staging.publication_number AS n ON b.event_id = n.start_event_id
UNION ALL
SELECT NULL, n.take_id, t.entry_id, t.event_id
FROM (
    SELECT event_id, entry_id FROM raw.agnocast_agnocast_create_callable
    UNION ALL
    SELECT event_id, entry_id FROM raw.agnocast_agnocast_take
) AS t
JOIN staging.take_number AS n ON t.event_id = n.start_event_id
ORDER BY event_id
