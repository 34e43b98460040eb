-- title: A publication was made inside several callback instances
-- description: A publication is made inside at most one callback instance.
-- cause: A mistake in msgflow, or input that it misunderstands.
-- cure: Report what msgflow check --detail prints, together with the trace.
-- grain: one row per run with such rows
-- severity: error
SELECT run_id, count(*) AS count, 'publications with several direct causes' AS detail
FROM (
    SELECT run_id
    FROM store.link_causal
    WHERE kind = 'direct'
    GROUP BY run_id, publication_id
    HAVING count(*) > 1
)
GROUP BY run_id
