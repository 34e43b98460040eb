-- title: Counters in Perfetto
-- description: The tracks of rates and of queues.
-- grain: one row per publisher and subscription
-- column: track BIGINT  Its track
-- column: parent BIGINT  Track of its process
-- column: name VARCHAR  What Perfetto calls it
-- column: unit VARCHAR  What its values are in
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
