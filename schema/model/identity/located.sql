-- description: The events of one tracepoint with the thread and process that they happened in.
-- grain: one row per event of the tracepoint
CREATE OR REPLACE MACRO staging.located(tracepoint) AS TABLE
SELECT e.*, c.thread_id, c.process_id
FROM query_table('raw.' || tracepoint) AS e
JOIN staging.thread AS c
    ON e.thread_index = c.thread_index
    AND e.event_id >= c.from_event_id
    AND e.event_id < c.until_event_id
