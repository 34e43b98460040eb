-- name: main.node
-- description: ROS nodes.
-- grain: one row per ROS node
-- column: node_id BIGINT  Identity of the node
-- column: run_id BIGINT  Run that the row belongs to
-- column: process_id BIGINT  Process it lives in
-- column: name VARCHAR  Name without namespace
-- column: namespace VARCHAR  Namespace, beginning with /
-- column: full_name VARCHAR  Namespace and name
-- column: node_handle UBIGINT  rcl node handle; an address, valid in its process until reused
-- column: created_ns BIGINT [epoch ns]  rcl_node_init
-- column: is_inferred BOOLEAN  Its initialisation was not traced
-- needs: store.node, derive.corrected_ns, derive.process_clock
SELECT
    self.node_id,
    self.run_id,
    self.process_id,
    self.name,
    self.namespace,
    self.full_name,
    self.node_handle,
    derive.corrected_ns(self.created_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS created_ns,
    self.is_inferred
FROM store.node AS self
JOIN derive.process_clock AS c ON self.process_id = c.process_id
