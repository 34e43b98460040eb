-- description: publish() calls whose message can only be found by time: those of processes that
--     never show the stamp of a message, and those of publishers for which the middleware has no
--     event though nothing was lost (rmw_zenoh, which writes messages with buffers to several
--     channels). Any other call without a stamp has lost an event.
-- grain: one row per such call
CREATE OR REPLACE MACRO derive.unstamped_call(only_run) AS TABLE
WITH unstamped_process AS (
    SELECT process_id
    FROM store.publication
    WHERE run_id = only_run
    GROUP BY process_id
    HAVING count(source_timestamp_ns) = 0
),
unfinished AS (
    SELECT
        run_id, publication_id, publisher_id, process_id, thread_id, next_event_ns, rcl_ns,
        is_loss_affected
    FROM store.publication
    WHERE run_id = only_run
        AND rcl_ns IS NOT NULL
        AND rmw_ns IS NULL
        AND dds_ns IS NULL
        AND source_timestamp_ns IS NULL
)
SELECT
    run_id, publication_id, publisher_id, process_id, thread_id, next_event_ns,
    coalesce(rmw_ns, rcl_ns) AS written_ns,
    rmw_ns IS NULL AS is_without_event
FROM store.publication
WHERE run_id = only_run
    AND coalesce(rmw_ns, rcl_ns) IS NOT NULL
    AND process_id IN (FROM unstamped_process)
UNION ALL
SELECT run_id, publication_id, publisher_id, process_id, thread_id, next_event_ns, rcl_ns, true
FROM unfinished
WHERE publisher_id IN (SELECT publisher_id FROM unfinished WHERE NOT is_loss_affected)
    AND process_id NOT IN (FROM unstamped_process)
