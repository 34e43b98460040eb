-- title: A take comes from several publications
-- description: A take comes from at most one publication.
-- cause: A mistake in msgflow, or input that it misunderstands.
-- cure: Report what msgflow check --detail prints, together with the trace.
-- grain: one row per run with such rows
-- severity: error
SELECT run_id, count(*) AS count, 'takes with several publications' AS detail
FROM (
    SELECT run_id
    FROM store.link_transport
    GROUP BY run_id, take_id
    HAVING count(*) > 1
)
GROUP BY run_id
