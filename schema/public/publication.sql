-- name: main.publication
-- description: Messages at the moment they were published, with the time of each layer seen.
-- grain: one row per publish() call
-- column: publication_id BIGINT  Identity of the publication
-- column: run_id BIGINT  Run that the row belongs to
-- column: trace_id BIGINT  Trace it was recorded in
-- column: publisher_id BIGINT  Publisher; NULL: the middleware itself
-- column: process_id BIGINT  Process it lives in
-- column: thread_id BIGINT  Thread it happened on
-- column: start_ns BIGINT [epoch ns]  First layer seen
-- column: end_ns BIGINT [epoch ns]  Last layer seen
-- column: intra_ns BIGINT [epoch ns]  rclcpp_intra_publish
-- column: rclcpp_ns BIGINT [epoch ns]  rclcpp_publish
-- column: rcl_ns BIGINT [epoch ns]  rcl_publish
-- column: rmw_ns BIGINT [epoch ns]  rmw_publish
-- column: dds_ns BIGINT [epoch ns]  dds:write
-- column: source_timestamp_ns BIGINT [epoch ns]  Stamp that the middleware gave to the message,
--     clock of ROS
-- column: is_loss_affected BOOLEAN  A gap right before or after it on its thread may hide a layer
-- needs: store.publication, derive.corrected_ns, derive.process_clock
SELECT
    self.publication_id,
    self.run_id,
    self.trace_id,
    self.publisher_id,
    self.process_id,
    self.thread_id,
    derive.corrected_ns(self.start_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS start_ns,
    derive.corrected_ns(self.end_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS end_ns,
    derive.corrected_ns(self.intra_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS intra_ns,
    derive.corrected_ns(self.rclcpp_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS rclcpp_ns,
    derive.corrected_ns(self.rcl_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS rcl_ns,
    derive.corrected_ns(self.rmw_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS rmw_ns,
    derive.corrected_ns(self.dds_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS dds_ns,
    self.source_timestamp_ns,
    coalesce(self.is_loss_affected, false) AS is_loss_affected
FROM store.publication AS self
JOIN derive.process_clock AS c ON self.process_id = c.process_id
