-- title: An interval ends before it begins
-- description: Nothing ends before it begins.
-- cause: A mistake in msgflow, or input that it misunderstands.
-- cure: Report what msgflow check --detail prints, together with the trace.
-- grain: one row per run and table
-- severity: error
WITH reversed AS (
    SELECT
        run_id,
        'publication' AS subject
    FROM store.publication
    WHERE end_ns < start_ns
    UNION ALL
    SELECT run_id, 'callback_instance'
    FROM store.callback_instance
    WHERE end_ns < start_ns
    UNION ALL
    SELECT run_id, 'executor_state'
    FROM derive.executor_interval
    WHERE end_ns < start_ns
)
SELECT
    run_id, subject,
    count(*) AS count,
    'rows that end before they begin' AS detail
FROM reversed
GROUP BY run_id, subject
