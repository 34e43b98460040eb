-- name: staging.publication_unstamped
-- description: Publications that left the process without a stamp.
-- grain: one row per such publish() call
-- when: staging.publication_call
SELECT start_event_id, end_event_id, thread_id
FROM staging.publication_call
WHERE source_timestamp_ns IS NULL AND coalesce(rmw_ns, rcl_ns) IS NOT NULL
