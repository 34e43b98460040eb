-- name: staging.callback_owner
-- description: What callbacks belong to whose creation was not traced, and that no message or
--     request was seen to be for, as far as the executor tells. The handle that it names may be
--     known. Else a timer or a subscription is all that it names, and where takes were enabled,
--     what runs without one is a timer. A callback that runs without being named belongs to a
--     service, where the requests that services take were not enabled. Where this was decided by
--     elimination, or the service was not seen to be initialised, the owner is a placeholder.
-- grain: one row per callback whose owner is decided
-- when: staging.callback_announced,
--     staging.callback_known WHERE kind = 'service' AND service_event_id IS NULL
WITH decided AS (
    SELECT
        a.process_id, a.callback_handle, a.callback_event_id, a.start_event_id, a.handle,
        a.owner_event_id,
        CASE
            WHEN a.is_disputed THEN NULL
            WHEN a.kind IS NOT NULL THEN a.kind
            WHEN a.handle IS NULL AND a.has_executions AND NOT a.has_requests THEN 'service'
            WHEN a.handle IS NOT NULL AND a.has_takes AND u.process_id IS NULL THEN 'timer'
        END AS kind
    FROM staging.callback_announced AS a
    LEFT JOIN staging.untraced_take AS u ON a.process_id = u.process_id
),
asked AS (
    SELECT DISTINCT b.callback_event_id
    FROM staging.request_callback AS q
    JOIN staging.callback_binding AS b ON q.start_event_id = b.start_event_id
),
service AS (
    SELECT process_id, service_handle, min(event_id) AS event_id
    FROM staging.callback_known
    WHERE kind = 'service' AND service_event_id IS NULL
    GROUP BY process_id, service_handle
)
SELECT
    process_id, callback_handle, callback_event_id, kind, handle,
    coalesce(owner_event_id, start_event_id) AS owner_event_id,
    owner_event_id IS NULL AS is_inferred,
    owner_event_id IS NULL AS is_eliminated
FROM decided
WHERE kind IS NOT NULL
UNION ALL
SELECT
    k.process_id, k.callback_handle, k.event_id, 'service', k.service_handle, s.event_id, true,
    false
FROM staging.callback_known AS k
JOIN service AS s ON k.process_id = s.process_id AND k.service_handle = s.service_handle
ANTI JOIN asked AS q ON k.event_id = q.callback_event_id
WHERE k.kind = 'service' AND k.service_event_id IS NULL
