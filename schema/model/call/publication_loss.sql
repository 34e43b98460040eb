-- name: staging.publication_loss
-- description: Publications that a gap may have cut or mixed. A gap lies right before or right
--     behind their events; or one of other CPUs inside, so that the events may be of two calls.
-- grain: one row per such publication
-- when: staging.beside_gap, staging.callback_gap
WITH elsewhere AS (
    SELECT thread_id, event_id FROM staging.callback_gap WHERE NOT is_between
)
SELECT c.start_event_id
FROM staging.publication_call AS c
JOIN staging.beside_gap AS g
    ON CASE WHEN g.is_behind THEN c.start_event_id ELSE c.end_event_id END = g.event_id
UNION
SELECT c.start_event_id
FROM (
    SELECT * FROM staging.publication_call WHERE thread_id IN (SELECT thread_id FROM elsewhere)
) AS c
ASOF JOIN elsewhere AS g ON c.thread_id = g.thread_id AND c.end_event_id >= g.event_id
WHERE g.event_id > c.start_event_id
