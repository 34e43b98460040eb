-- description: States of managed nodes (with a lifecycle). The state before the first change lasts
--     from the creation of the node, or from the first event of its process, the last one until the
--     last event of the process. A state is left out where the next change leaves another one. A
--     node that never changed its state has none.
-- grain: one row per stretch of a node in one state
-- column: run_id
-- column: node_id BIGINT  Node
-- column: state VARCHAR  State as the node calls it: 'unconfigured', 'inactive', 'active',
--     'finalized', or between two of them 'configuring', 'activating' and so on
-- column: start_ns, end_ns
SELECT
    s.run_id, s.node_id, s.state,
    derive.corrected_ns(s.start_ns, p) AS start_ns,
    derive.corrected_ns(s.end_ns, p) AS end_ns
FROM derive.node_state AS s
JOIN store.node AS n ON s.node_id = n.node_id
JOIN derive.process_clock AS p ON n.process_id = p.process_id
