-- description: The events of one tracepoint that is a stage of calls, with what directly precedes
--     each on its thread, unless a gap lies between the two, and with where each happened, as one
--     value (`place`).
-- grain: one row per event of the tracepoint
CREATE OR REPLACE MACRO staging.call(tracepoint) AS TABLE
SELECT
    e.*,
    CASE WHEN g.event_id IS NULL THEN e.previous_call_event_id END AS previous_event_id,
    {
        'event_id': e.event_id,
        'ts_ns': e.ts_ns,
        'trace_index': e.trace_index,
        'thread_index': e.thread_index
    } AS place
FROM query_table('raw.' || tracepoint) AS e
LEFT JOIN (SELECT event_id FROM staging.near_gap WHERE sequence = 'call' AND is_behind) AS g
    ON e.event_id = g.event_id
