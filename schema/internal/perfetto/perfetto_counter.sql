-- kind: inline
-- description: The tracks of rates and of queues.
-- grain: one row per publisher and subscription
SELECT publisher_id * 8 + 4 AS track, process_id * 8 + 1 AS parent,
    'rate of ' || coalesce(topic_name, '?') AS name, 'Hz' AS unit
FROM main.publisher
WHERE run_id = $run_id
UNION ALL
SELECT subscription_id * 8 + 5, process_id * 8 + 1,
    'not yet taken of ' || coalesce(topic_name, '?'), 'messages'
FROM main.subscription
WHERE run_id = $run_id
ORDER BY track
