-- description: Threads of all processes.
-- grain: one row per thread
-- when: staging.context
SELECT
    thread_id, process_id, vtid AS tid, name, first_event_id, last_event_id, first_seen_ns,
    last_seen_ns
FROM staging.context
