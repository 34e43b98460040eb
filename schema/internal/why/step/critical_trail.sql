-- title: The way of one flow, from the ways of all
-- description: The step critical_trail of critical-path: the breakdown has the flow that is shown.
-- grain: one row per flow and hop
-- reads: breakdown_flow, breakdown_trail, critical_flow
SELECT c.flow_id, t.hop, t.take_id, t.publication_id, t.previous_take_id, t.next_take_id
FROM critical_flow AS c
JOIN breakdown_flow AS b
    ON c.path_id = b.path_id AND c.root_kind = b.root_kind AND c.root_id = b.root_id
    AND c.take_id = b.take_id
JOIN breakdown_trail AS t ON b.flow_id = t.flow_id
