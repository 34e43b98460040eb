-- title: Timers that may use what their node was told before
-- description: Links that may be missing (main.dead_end), from messages that a node keeps to its
--     timers. A closed loop counts, too: a controller hears where the robot is. Of several timers
--     only the fastest counts; the others report on the node, as does one whose messages no node
--     takes. A timer that runs for less than a tenth of the time that the callback of a message
--     takes does not use it.
-- grain: as main.dead_end
-- when: main.timer WHERE node_id IN (SELECT node_id FROM main.subscription WHERE NOT is_internal)
-- column: node_id BIGINT  As in main.dead_end
-- column: timer_id BIGINT  Likewise
-- column: topic_name VARCHAR  Likewise
WITH heard AS (
    SELECT DISTINCT s.topic_name
    FROM main.subscription AS s
    SEMI JOIN main.take AS t ON s.subscription_id = t.subscription_id
    WHERE list_contains($runs, s.run_id)
)
SELECT d.node_id, d.timer_id, d.topic_name
FROM main.dead_end($runs) AS d
JOIN main.timer AS t ON d.timer_id = t.timer_id
WHERE d.output_topic IN (SELECT topic_name FROM heard)
    AND coalesce(d.run_ns <= 10 * d.publishing_run_ns, true)
QUALIFY t.period_ns = min(t.period_ns) OVER (PARTITION BY d.node_id, d.topic_name)
