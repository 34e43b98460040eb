-- description: Callback objects, numbered in the order in which they were made. One whose creation
--     was not traced counts from its first instance.
-- grain: one row per callback object
-- when: staging.callback_known, staging.callback_binding
WITH every_callback AS (
    FROM staging.callback_known
    UNION ALL BY NAME
    SELECT DISTINCT
        callback_event_id AS event_id,
        process_id, kind, callback_handle
    FROM staging.callback_binding
    WHERE kind = 'unknown'
        AND callback_event_id NOT IN (SELECT event_id FROM staging.callback_known)
)
SELECT
    row_number() OVER (ORDER BY event_id) AS callback_id,
    *
FROM every_callback
