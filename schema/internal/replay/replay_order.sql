-- title: Who comes first of two callbacks
-- description: How often one callback ran before another, where a wait had found both ready.
--     Executors keep an order of their own, which is not that of creation.
-- grain: one row per ordered pair of callbacks that were ready at once
-- reads: replay_instance
-- column: first_id BIGINT  The callback that ran first
-- column: second_id BIGINT  The other one
-- column: rounds BIGINT  How often it did
SELECT
    a.callback_id AS first_id,
    b.callback_id AS second_id,
    count(*) AS rounds
FROM replay_instance AS a
JOIN replay_instance AS b
    ON a.executor_id = b.executor_id
    AND a.round_ns = b.round_ns
    AND a.looked_ns < b.looked_ns
WHERE a.callback_id <> b.callback_id
GROUP BY a.callback_id, b.callback_id
ORDER BY first_id, second_id
