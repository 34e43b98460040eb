-- name: main.publisher
-- description: Publishers, those of ROS itself marked as internal.
-- grain: one row per publisher
-- column: publisher_id BIGINT  Identity of the publisher
-- column: run_id BIGINT  Run that the row belongs to
-- column: process_id BIGINT  Process it lives in
-- column: node_id BIGINT  Node it belongs to
-- column: topic_name VARCHAR  Fully expanded topic name
-- column: publisher_handle UBIGINT  rcl publisher handle; an address, valid in its process until
--     reused
-- column: rmw_handle UBIGINT  rmw publisher handle; an address, valid in its process until reused
-- column: gid BLOB  Global identifier, 16 bytes; NULL: none
-- column: queue_depth BIGINT  History depth asked for
-- column: created_ns BIGINT [epoch ns]  First initialisation event
-- column: is_internal BOOLEAN  Infrastructure of ROS (/rosout, /parameter_events, ...)
-- column: is_inferred BOOLEAN  Its initialisation was not traced
-- needs: store.publisher, derive.corrected_ns, derive.process_clock
SELECT
    self.publisher_id,
    self.run_id,
    self.process_id,
    self.node_id,
    self.topic_name,
    self.publisher_handle,
    self.rmw_handle,
    self.gid,
    self.queue_depth,
    derive.corrected_ns(self.created_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS created_ns,
    self.is_internal,
    self.is_inferred
FROM store.publisher AS self
JOIN derive.process_clock AS c ON self.process_id = c.process_id
