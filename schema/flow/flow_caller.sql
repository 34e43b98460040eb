-- name: derive.flow_caller
-- description: Runs of callbacks on whose request service callbacks ran: directly, or through other
--     services in between.
-- grain: one row per run of a service callback and run that it was called from
-- needs: store.callback_instance, store.link_request
WITH RECURSIVE called AS (
    SELECT i.run_id, i.callback_instance_id, l.callback_instance_id AS caller_id
    FROM store.callback_instance AS i
    JOIN store.link_request AS l ON i.request_id = l.request_id
    WHERE i.request_id IS NOT NULL AND l.callback_instance_id IS NOT NULL
),
caller (run_id, callback_instance_id, caller_id) AS (
    SELECT run_id, callback_instance_id, caller_id FROM called
    UNION
    SELECT c.run_id, c.callback_instance_id, d.caller_id
    FROM caller AS c
    JOIN called AS d ON c.caller_id = d.callback_instance_id
)
SELECT run_id, callback_instance_id, caller_id FROM caller
