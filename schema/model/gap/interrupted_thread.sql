-- name: staging.interrupted_thread
-- description: Threads with a gap between events of theirs, and those of several lives of their
--     process.
-- grain: one row per such thread, as events name it
-- needs: staging.near_gap, staging.context
WITH interrupted AS (
    SELECT c.thread_id
    FROM staging.context AS c
    WHERE c.thread_index IN (SELECT thread_index FROM staging.near_gap)
    UNION
    SELECT any_value(thread_id)
    FROM staging.context
    GROUP BY thread_index
    HAVING count(*) > 1
)
SELECT DISTINCT thread_index
FROM staging.context
WHERE thread_id IN (SELECT thread_id FROM interrupted)
