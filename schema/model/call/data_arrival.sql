-- name: staging.data_arrival
-- description: When messages arrived before they were taken, as the listener of the middleware says
--     (CARET, with Fast DDS): the first time that its process had one of that stamp. With several
--     readers in the process it is not known which of them had it then.
-- grain: one row per take that such an event came before
-- when: raw.ros2_caret_on_data_available
SELECT
    n.take_id,
    t.taken_ns - min(a.ts_ns) AS waited_ns,
    count(*) > 1 AS is_ambiguous
FROM staging.located('ros2_caret_on_data_available') AS a
JOIN staging.take_chain AS t
    ON a.process_id = t.process_id AND a.source_stamp = t.source_timestamp_ns
JOIN staging.take_number AS n ON t.start_event_id = n.start_event_id
WHERE a.event_id < t.start_event_id
GROUP BY n.take_id, t.taken_ns
