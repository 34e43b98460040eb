-- name: main.service
-- description: Services, those of ROS itself marked as internal.
-- grain: one row per service
-- column: service_id BIGINT  Identity of the service
-- column: run_id BIGINT  Run that the row belongs to
-- column: process_id BIGINT  Process it lives in
-- column: node_id BIGINT  Node it belongs to
-- column: service_name VARCHAR  Fully expanded service name
-- column: service_handle UBIGINT  rcl service handle; an address, valid in its process until reused
-- column: rmw_handle UBIGINT  rmw service handle; an address, valid in its process until reused
-- column: gid BLOB  Global identifier, 16 bytes; NULL: none
-- column: created_ns BIGINT [epoch ns]  rcl_service_init
-- column: is_internal BOOLEAN  Infrastructure of ROS (parameter and lifecycle services)
-- column: is_inferred BOOLEAN  Its initialisation was not traced
-- needs: store.service, derive.corrected_ns, derive.process_clock
SELECT
    self.service_id,
    self.run_id,
    self.process_id,
    self.node_id,
    self.service_name,
    self.service_handle,
    self.rmw_handle,
    self.gid,
    derive.corrected_ns(self.created_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS created_ns,
    self.is_internal,
    self.created_ns IS NULL AS is_inferred
FROM store.service AS self
JOIN derive.process_clock AS c ON self.process_id = c.process_id
