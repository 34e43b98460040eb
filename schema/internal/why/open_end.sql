-- title: Timers that may use what their node was told before
-- description: Likely links that are not declared (main.dead_end), from messages that a node keeps
--     to timers of it.
-- grain: as main.dead_end
-- when: main.finding WHERE name = 'dead_end' AND list_contains($runs, run_id)
SELECT node_id, timer_id, topic_name
FROM main.dead_end($runs)
WHERE is_likely AND timer_id IS NOT NULL
