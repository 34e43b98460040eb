-- The same numbers of messages, from what really happened: which /VehicleInterface messages each
-- /FrontLidarDriver message was used for, and without the messages that were used again.
WITH RECURSIVE edge AS (
    SELECT c.callback_instance_id AS cause, t.callback_instance_id AS effect, c.is_reuse,
        t.node AS effect_node
    FROM causal AS c
    JOIN take AS t ON c.publication_id = t.publication_id
    WHERE NOT c.is_internal AND t.callback_instance_id IS NOT NULL
),
root AS (
    SELECT callback_instance_id AS root_id
    FROM callback_instance
    WHERE node = '/FrontLidarDriver'
        AND kind = 'timer'
        AND start_ns BETWEEN $from_ns AND $until_ns
),
reached (root_id, instance_id, node, is_reusing) AS (
    SELECT root_id, root_id, '', reuse.is_reusing
    FROM root
    CROSS JOIN (VALUES (true), (false)) AS reuse (is_reusing)
    UNION
    SELECT r.root_id, e.effect, e.effect_node, r.is_reusing
    FROM reached AS r
    JOIN edge AS e ON r.instance_id = e.cause
    WHERE r.is_reusing OR NOT e.is_reuse
),
counted AS (
    SELECT root_id, is_reusing, count(*) AS messages
    FROM reached
    WHERE node = '/VehicleDBWSystem'
    GROUP BY root_id, is_reusing
)
SELECT is_reusing, count(*) AS roots, histogram(messages) AS messages
FROM counted
GROUP BY is_reusing
ORDER BY is_reusing DESC
