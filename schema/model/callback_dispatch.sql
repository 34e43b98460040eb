-- name: staging.callback_dispatch
-- description: The executor event before each start of a callback on its thread, where no gap lies
--     between the two.
-- grain: one row per callback_start that an executor event is known to precede
-- needs: staging.dispatch_candidate, staging.behind_gap, staging.dispatch_event
SELECT c.start_event_id, c.executor_event_id
FROM staging.dispatch_candidate AS c
ANTI JOIN staging.behind_gap('staging.dispatch_event') AS g ON c.start_event_id = g.event_id
