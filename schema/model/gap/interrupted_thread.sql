-- name: staging.interrupted_thread
-- description: Threads with a gap between events of theirs, and those of several lives of their
--     process.
-- grain: one row per such thread, as events name it
WITH interrupted AS (
    SELECT thread_index FROM staging.near_gap
    UNION
    SELECT thread_index FROM staging.context GROUP BY thread_index HAVING count(*) > 1
)
SELECT DISTINCT o.thread_index
FROM staging.context AS c
JOIN interrupted AS i ON c.thread_index = i.thread_index
JOIN staging.context AS o ON c.thread_id = o.thread_id
