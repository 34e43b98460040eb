-- title: Executors to replay
-- description: What the recording tells of executors: how many threads spin them, when these first
--     looked for work (start_ns), and how long they need from there to a wait (falling_ns), if
--     waits are known (has_rounds).
-- grain: one row per executor
WITH thread AS (
    SELECT
        x.executor_id,
        count(*) AS threads
    FROM main.executor_thread AS x
    WHERE x.run_id = $run_id
    GROUP BY x.executor_id
),
state AS (
    SELECT
        s.executor_id, s.state, s.start_ns,
        s.start_ns - lag(s.start_ns) OVER (PARTITION BY s.thread_id ORDER BY s.start_ns) AS after_ns
    FROM main.executor_state AS s
    WHERE s.run_id = $run_id
)
SELECT
    e.executor_id, e.kind, t.threads,
    count(s.start_ns) FILTER (WHERE s.state = 'wait') > 0 AS has_rounds,
    min(s.start_ns) AS start_ns,
    quantile_disc(s.after_ns, 0.5) FILTER (WHERE s.state = 'wait') AS falling_ns
FROM main.executor AS e
JOIN thread AS t ON e.executor_id = t.executor_id
LEFT JOIN state AS s ON e.executor_id = s.executor_id
GROUP BY e.executor_id, e.kind, t.threads
ORDER BY e.executor_id
