-- description: Threads that take for a subscription: those that did, and those of the same
--     executor. If a subscription never took anything: every executor thread of its process.
-- grain: one row per subscription and thread
WITH taking AS (
    SELECT DISTINCT run_id, subscription_id, thread_id
    FROM store.take
    WHERE subscription_id IS NOT NULL
),
never AS (
    SELECT s.run_id, s.subscription_id, s.process_id
    FROM store.subscription AS s
    ANTI JOIN taking AS t ON s.subscription_id = t.subscription_id
)
SELECT run_id, subscription_id, thread_id FROM taking
UNION
SELECT t.run_id, t.subscription_id, o.thread_id
FROM taking AS t
JOIN store.executor_thread AS e ON t.thread_id = e.thread_id
JOIN store.executor_thread AS o ON e.executor_id = o.executor_id
UNION
SELECT n.run_id, n.subscription_id, h.thread_id
FROM never AS n
JOIN store.thread AS h ON n.process_id = h.process_id
WHERE h.thread_id IN (SELECT thread_id FROM store.executor_thread)
