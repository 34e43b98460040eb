-- name: staging.thread_gap
-- description: Run-time events with a gap between themselves and the one before on their thread.
--     Nothing is paired across them.
-- grain: one row per run-time event behind a gap
-- needs: staging.behind_gap, staging.thread_event
SELECT event_id, thread_id
FROM staging.behind_gap('staging.thread_event')
