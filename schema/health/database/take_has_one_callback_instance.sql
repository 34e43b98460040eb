-- title: A take leads to several callback instances
-- description: A take leads to at most one callback instance.
-- cause: A mistake in msgflow, or input that it misunderstands.
-- cure: Report what msgflow check --detail prints, together with the trace.
-- grain: one row per run with such rows
-- severity: error
SELECT run_id, count(*) AS count, 'takes with several callback instances' AS detail
FROM (
    SELECT run_id
    FROM store.callback_instance
    WHERE take_id IS NOT NULL
    GROUP BY run_id, take_id
    HAVING count(*) > 1
)
GROUP BY run_id
