-- title: A row refers to one that does not exist
-- description: Every identity in a column that refers to another table is one of a row there, of
--     the same run: nothing is linked across runs.
-- cause: A mistake in msgflow, or input that it misunderstands.
-- cure: Report what msgflow check --detail prints, together with the trace.
-- grain: one row per run and column with such identities
-- severity: error
-- param: broken STRUCT[]  Run, column, table it refers to, count; from `msgflow/db/finding.py`
SELECT
    broken.run_id,
    broken.child AS subject,
    broken.count,
    'identities that are no row of ' || broken.parent AS detail
FROM (
    SELECT unnest(
        $broken::STRUCT(run_id BIGINT, child VARCHAR, parent VARCHAR, count BIGINT)[]
    ) AS broken
)
