-- description: Readers that an instrumented DDS created for topics of ROS, in processes without a
--     subscription of that topic: of a program without ROS, or of a node whose own events are not
--     recorded.
-- grain: one row per such reader
-- when: raw.dds_create_reader
SELECT
    r.process_id,
    r.topic_name[3:] AS topic_name,
    r.ts_ns AS created_ns
FROM staging.located('raw.dds_create_reader') AS r
ANTI JOIN staging.subscription AS s
    ON r.process_id = s.process_id AND r.topic_name = 'rt' || s.topic_name
WHERE r.topic_name LIKE 'rt/%'
ORDER BY r.event_id
