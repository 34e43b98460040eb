-- description: States of managed nodes, by the clock of their process. The state before the first
--     change lasts from the creation of the node, or from the first event of its process. The last
--     one lasts until the last event of the process. A state is left out where the next change
--     leaves another one: a change in between was not recorded.
-- grain: one row per stretch of a node in one state
WITH change AS (
    SELECT
        run_id, node_id, at_ns, start_state, goal_state,
        lag(at_ns) OVER of_node AS previous_ns,
        lead(at_ns) OVER of_node AS next_ns,
        lead(start_state) OVER of_node AS next_state
    FROM store.lifecycle_transition
    WHERE node_id IS NOT NULL
    WINDOW of_node AS (PARTITION BY node_id ORDER BY at_ns)
)
SELECT
    c.run_id, c.node_id,
    c.start_state AS state,
    coalesce(n.created_ns, p.first_seen_ns) AS start_ns,
    c.at_ns AS end_ns
FROM change AS c
JOIN store.node AS n ON c.node_id = n.node_id
JOIN store.process AS p ON n.process_id = p.process_id
WHERE c.previous_ns IS NULL
UNION ALL
SELECT
    c.run_id, c.node_id, c.goal_state, c.at_ns,
    coalesce(c.next_ns, p.last_seen_ns)
FROM change AS c
JOIN store.node AS n ON c.node_id = n.node_id
JOIN store.process AS p ON n.process_id = p.process_id
WHERE coalesce(c.next_state = c.goal_state, c.next_ns IS NULL)
