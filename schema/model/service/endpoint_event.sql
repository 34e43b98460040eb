-- description: What clients, or services, sent and took, each with its client or service: the one
--     of that handle initialised last before, else a placeholder by the first use of the handle.
--     Both are the names of tables: events as recorded, with the rmw `handle` they are of, and the
--     initialised objects.
-- grain: one row per event
CREATE OR REPLACE MACRO staging.endpoint_event(events, objects) AS TABLE
WITH located AS NOT MATERIALIZED (
    FROM staging.located(events)
),
resolved AS NOT MATERIALIZED (FROM staging.with_latest('located', objects)),
first_use AS (
    SELECT
        process_id, handle,
        min(event_id) AS event_id
    FROM resolved
    WHERE object_event_id IS NULL
    GROUP BY process_id, handle
)
SELECT
    r.* EXCLUDE (object_event_id),
    coalesce(r.object_event_id, f.event_id) AS object_event_id,
    r.object_event_id IS NULL AS is_inferred
FROM resolved AS r
LEFT JOIN first_use AS f
    ON r.object_event_id IS NULL AND r.process_id = f.process_id AND r.handle = f.handle
