-- description: The node of each object, by the event that initialised the object.
-- grain: one row per object or timer link that names a node
-- when: staging.node_use
SELECT u.event_id, n.node_id
FROM staging.node_use AS u
JOIN staging.node AS n
    ON coalesce(u.node_event_id, n.event_id) = n.event_id
    AND u.process_id = n.process_id
    AND u.node_handle = n.node_handle
    AND (u.node_event_id IS NOT NULL OR n.is_inferred)
