-- title: A request and its callback instance do not agree
-- description: A request leads to at most one callback instance, and both say so.
-- cause: A mistake in msgflow, or input that it misunderstands.
-- cure: Report what msgflow check --detail prints, together with the trace.
-- grain: one row per run with such rows
-- severity: error
SELECT
    coalesce(q.run_id, i.run_id) AS run_id,
    count(*) AS count,
    'requests and callback instances that do not name each other' AS detail
FROM store.request AS q
FULL JOIN (SELECT * FROM store.callback_instance WHERE request_id IS NOT NULL) AS i
    ON q.request_id = i.request_id
WHERE q.callback_instance_id IS DISTINCT FROM i.callback_instance_id
GROUP BY coalesce(q.run_id, i.run_id)
