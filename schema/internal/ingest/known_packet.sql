-- description: Runs of the database that hold packets of `packet_batch`, which were just read.
-- grain: one row per such run
-- reads: packet_batch
SELECT DISTINCT r.run_id, r.name
FROM packet_batch AS b
JOIN staging.source AS s ON b.trace_index = s.trace_index
JOIN store.trace AS t ON s.uuid = t.uuid
JOIN store.packet AS p
    ON t.trace_id = p.trace_id
    AND b.stream_class_id = p.stream_class_id
    AND b.stream_instance_id IS NOT DISTINCT FROM p.stream_instance_id
    AND b.begin_ns = p.begin_ns
JOIN store.run AS r ON p.run_id = r.run_id
ORDER BY r.run_id
