-- description: Callback instances with their callback object, and the take or the request that
--     they were called with. The callback_start directly follows the take's last layer, or the
--     rmw_take_request, on its thread, with no event of the executor between the two. Neither an
--     rmw take nor a request is for an intra-process call, nor is a dequeue for another one. The
--     subscriptions, or services, agree where both are known.
-- grain: one row per callback_start
-- when: staging.callback_pair_plain, staging.callback_pair_left_over
WITH begun AS NOT MATERIALIZED (
    SELECT
        start_event_id AS event_id, process_id, callback_handle AS handle, is_intra_process,
        previous_event_id, previous_executor_event_id
    FROM staging.callback_pair
),
known AS (SELECT event_id, process_id, callback_handle AS handle FROM staging.callback_known),
run AS (
    SELECT
        b.event_id AS start_event_id, b.process_id, b.handle AS callback_handle,
        b.is_intra_process, b.object_event_id AS callback_event_id, k.kind,
        k.subscription_event_id, k.service_event_id,
        -- As recorded: what the executor said after the take stands, whatever else was lost. It is
        -- NULL only where the thread had no executor event at all.
        CASE
            WHEN coalesce(b.previous_executor_event_id < b.previous_event_id, true)
                THEN b.previous_event_id
        END AS called_by_event_id
    FROM staging.with_latest('begun', 'known') AS b
    LEFT JOIN staging.callback_known AS k ON b.object_event_id = k.event_id
)
SELECT
    r.start_event_id, r.process_id, r.callback_handle, r.is_intra_process, r.callback_event_id,
    r.kind, t.start_event_id AS take_event_id,
    coalesce(r.subscription_event_id, t.subscription_event_id) AS subscription_event_id,
    coalesce(q.event_id, p.request_event_id) AS request_event_id
FROM run AS r
LEFT JOIN staging.take_chain AS t
    ON r.called_by_event_id = t.end_event_id
    AND coalesce(r.kind IN ('subscription', 'unknown', 'function'), true)
    AND r.is_intra_process = (t.method = 'ring_buffer')
    AND coalesce(r.subscription_event_id = t.subscription_event_id, true)
LEFT JOIN (SELECT * FROM staging.service_event WHERE is_request) AS q
    ON r.called_by_event_id = q.event_id
    AND coalesce(r.kind IN ('service', 'unknown', 'function'), true)
    AND NOT r.is_intra_process
    AND coalesce(r.service_event_id = q.service_event_id, true)
LEFT JOIN staging.callback_step AS p ON r.start_event_id = p.start_event_id
