-- name: derive.partial_sync_firing
-- kind: macro
-- description: Firings of partially synchronous annotations: runs of a callback of an input that
--     publish on an output. All publications of a run are one firing; it empties the caches. What
--     was published last by another firing, before it published first, is when they were emptied
--     before.
-- grain: one row per annotation and run of a callback of one of its inputs that fires it
-- param: only_run BIGINT  Run to look at
-- needs: derive.annotated_publication, store.annotation_input
CREATE OR REPLACE MACRO derive.partial_sync_firing(only_run) AS TABLE
WITH fired AS (
    SELECT
        b.run_id, b.annotation_id, b.callback_instance_id, b.start_event_id,
        lag(b.start_event_id) OVER (
            PARTITION BY b.annotation_id ORDER BY b.start_event_id
        ) AS previous_event_id
    FROM derive.annotated_publication(only_run) AS b
    JOIN store.annotation_input AS i
        ON b.annotation_id = i.annotation_id AND b.subscription_id = i.subscription_id
    WHERE b.kind = 'partial_sync'
)
SELECT
    run_id, annotation_id, callback_instance_id,
    arg_min_null(previous_event_id, start_event_id) AS emptied_event_id
FROM fired
GROUP BY run_id, annotation_id, callback_instance_id
