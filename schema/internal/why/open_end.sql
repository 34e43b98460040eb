-- name: internal.open_end
-- title: Timers that may use what their node was told before
-- description: Likely links that are not declared (main.dead_end), from messages that a node keeps
--     to timers of it.
-- grain: as main.dead_end
-- when: store.finding WHERE name = 'dead_end' AND list_contains($runs, run_id)
-- column: node_id BIGINT  As in main.dead_end
-- column: timer_id BIGINT  Likewise
-- column: topic_name VARCHAR  Likewise
SELECT node_id, timer_id, topic_name
FROM main.dead_end($runs)
WHERE is_likely AND timer_id IS NOT NULL
