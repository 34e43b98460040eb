-- name: main.lifecycle_transition
-- description: State changes of managed nodes.
-- grain: one row per state change of a managed node
-- column: run_id BIGINT  Run that the row belongs to
-- column: node_id BIGINT  The node
-- column: at_ns BIGINT [epoch ns]  Moment of the change
-- column: start_state VARCHAR  State that was left
-- column: goal_state VARCHAR  State that was entered
-- needs: store.lifecycle_transition, store.node, derive.corrected_ns, derive.process_clock
SELECT
    self.run_id,
    self.node_id,
    derive.corrected_ns(self.at_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS at_ns,
    self.start_state,
    self.goal_state
FROM store.lifecycle_transition AS self
LEFT JOIN store.node AS n ON self.node_id = n.node_id
LEFT JOIN derive.process_clock AS c ON n.process_id = c.process_id
