-- name: staging.callback_loss
-- description: Callback instances with a gap inside, right before, or (never seen to end) right
--     after; or with one of other CPUs in their time, which the thread may have visited: two
--     instances may look like one.
-- grain: one row per such callback instance
-- when: staging.beside_gap, staging.callback_gap
WITH exposed AS (
    SELECT start_event_id, thread_id, end_event_id, effective_end_event_id
    FROM staging.callback_run
    WHERE thread_id IN (SELECT thread_id FROM staging.beside_gap)
),
elsewhere AS (
    SELECT thread_id, event_id FROM staging.callback_gap WHERE NOT is_between
)
SELECT e.start_event_id
FROM exposed AS e
ASOF JOIN (SELECT thread_id, event_id FROM staging.beside_gap WHERE is_behind) AS g
    ON e.thread_id = g.thread_id AND e.effective_end_event_id >= g.event_id
WHERE g.event_id >= e.start_event_id
UNION
SELECT e.start_event_id
FROM (SELECT * FROM exposed WHERE end_event_id IS NULL) AS e
ASOF JOIN (SELECT thread_id, event_id FROM staging.beside_gap WHERE NOT is_behind) AS g
    ON e.thread_id = g.thread_id AND e.effective_end_event_id > g.event_id
WHERE g.event_id >= e.start_event_id
UNION
SELECT e.start_event_id
FROM (
    SELECT * FROM staging.callback_run WHERE thread_id IN (SELECT thread_id FROM elsewhere)
) AS e
ASOF JOIN elsewhere AS g
    ON e.thread_id = g.thread_id AND e.effective_end_event_id >= g.event_id
WHERE g.event_id > e.start_event_id
