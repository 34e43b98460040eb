-- name: staging.node_use
-- description: Which initialisation of a node handle each object belongs to: the latest before
--     it, except that an object created inside its node belongs to the one right after, and that
--     any later one is better than none.
-- grain: one row per object or timer link that names a node
-- when: staging.construction
WITH use AS (
    SELECT event_id, process_id, node_handle, precedes_own_node
    FROM staging.construction
    WHERE kind <> 'node'
),
node_init AS (
    SELECT event_id, process_id, node_handle FROM staging.construction WHERE kind = 'node'
),
earlier AS (
    SELECT u.event_id, n.event_id AS node_event_id
    FROM use AS u
    ASOF LEFT JOIN node_init AS n
        ON u.process_id = n.process_id
        AND u.node_handle = n.node_handle
        AND u.event_id >= n.event_id
),
later AS (
    SELECT u.event_id, n.event_id AS node_event_id
    FROM use AS u
    ASOF LEFT JOIN node_init AS n
        ON u.process_id = n.process_id
        AND u.node_handle = n.node_handle
        AND u.event_id <= n.event_id
)
SELECT
    u.event_id,
    u.process_id,
    u.node_handle,
    CASE
        WHEN u.precedes_own_node THEN l.node_event_id
        ELSE coalesce(e.node_event_id, l.node_event_id)
    END AS node_event_id
FROM use AS u
JOIN earlier AS e ON u.event_id = e.event_id
JOIN later AS l ON u.event_id = l.event_id
