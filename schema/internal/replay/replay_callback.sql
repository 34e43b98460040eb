-- title: Callbacks to replay
-- description: What executors run, in the order of creation, and what makes it ready.
-- grain: one row per callback that ran
-- reads: replay_instance
-- column: label VARCHAR  What triggers it
-- column: created_ns BIGINT [epoch ns]  When its timer was created
-- column: is_python BOOLEAN  rclpy runs it
-- column: callback_group_id BIGINT  Its group; NULL: not known
-- column: is_reentrant BOOLEAN  Its group lets its callbacks run at the same time; NULL: not known
WITH ran AS (
    SELECT
        callback_id,
        mode(executor_id) AS executor_id,
        coalesce(bool_or(publication_id < 0), false) AS is_called
    FROM replay_instance
    GROUP BY callback_id
)
SELECT
    c.callback_id, r.executor_id, c.kind, l.node, l.label, c.symbol,
    CASE WHEN r.is_called THEN -c.callback_id ELSE c.subscription_id END AS subscription_id,
    coalesce(s.queue_depth, 0) AS queue_depth,
    s.topic_name, t.period_ns, t.created_ns,
    p.python_version IS NOT NULL AS is_python,
    g.callback_group_id,
    g.kind = 'reentrant' AS is_reentrant
FROM ran AS r
JOIN main.callback AS c ON r.callback_id = c.callback_id
JOIN main.callback_label AS l ON c.callback_id = l.callback_id
JOIN main.process AS p ON c.process_id = p.process_id
LEFT JOIN main.subscription AS s ON c.subscription_id = s.subscription_id
LEFT JOIN main.timer AS t ON c.timer_id = t.timer_id
LEFT JOIN main.callback_group_member AS m ON c.callback_id = m.callback_id
LEFT JOIN main.callback_group AS g ON m.callback_group_id = g.callback_group_id
ORDER BY c.created_ns, c.callback_id
