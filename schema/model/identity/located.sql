-- description: Events with the thread and process that they happened in. `events` is the name of a
--     table with their ids and thread indexes: 'raw.TRACEPOINT', or rows made of such events.
-- grain: one row per event
CREATE OR REPLACE MACRO staging.located(events) AS TABLE
SELECT e.*, t.thread_id, t.process_id
FROM query_table(events) AS e
JOIN staging.thread AS t
    ON e.thread_index = t.thread_index
    AND e.event_id >= t.from_event_id
    AND e.event_id < t.until_event_id
