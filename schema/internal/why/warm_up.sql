-- title: When the system of an explanation had warmed up
-- description: The moment of the last of the longest latencies, if they all lie at the start. It
--     reads the flows of an explanation.
-- grain: one row
-- reads: path_outcome
-- column: last_ns BIGINT [epoch ns]  It had not warmed up by then; NULL: it does not warm up
WITH flow AS (
    SELECT
        run_id AS side,
        alike_id AS subject,
        root_ns AS at_ns,
        latency_ns AS value_ns,
        count(*) OVER (PARTITION BY run_id, alike_id) AS number,
        row_number() OVER (
            PARTITION BY run_id, alike_id ORDER BY root_ns, root_id, latency_ns
        ) - 1 AS position
    FROM path_outcome
    WHERE status = 'reached' AND is_first AND latency_ns IS NOT NULL
    QUALIFY number >= 20
)
SELECT max(last_ns) AS last_ns FROM derive.warm_up('flow')
