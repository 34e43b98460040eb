-- description: How often functions ran, and were called by what ran, in samples of stacks.
-- grain: one row per group and function that a sample of the group saw
-- param: of_samples VARCHAR  Name of the samples, with columns group_id, stack_id and cpu_ns: a
--     table, or a part of the query
-- column: group_id BIGINT  Group of the samples
-- column: stack_frame_id BIGINT  Function
-- column: self_samples, samples
-- column: self_ns BIGINT [ns]  CPU time of these; NULL: perf counted cycles
-- column: total_ns BIGINT [ns]  CPU time of those
-- column: self_share DOUBLE [share]  Part of the samples of the group in which it ran
-- column: total_share
CREATE OR REPLACE MACRO main.function_time(of_samples) AS TABLE
WITH seen AS MATERIALIZED (
    SELECT
        group_id, stack_id,
        count(*) AS samples,
        sum(cpu_ns)::BIGINT AS cpu_ns
    FROM query_table(of_samples)
    GROUP BY group_id, stack_id
),
-- A function that calls itself counts once.
within AS (
    SELECT DISTINCT stack_id, stack_frame_id
    FROM main.stack_call
    WHERE stack_id IN (SELECT stack_id FROM seen)
),
whole AS (
    SELECT
        group_id,
        sum(samples) AS samples
    FROM seen
    GROUP BY group_id
)
SELECT
    s.group_id, w.stack_frame_id,
    coalesce(sum(s.samples) FILTER (WHERE is_self), 0)::BIGINT AS self_samples,
    sum(s.samples)::BIGINT AS samples,
    sum(CASE WHEN is_self THEN s.cpu_ns WHEN s.cpu_ns IS NOT NULL THEN 0 END)::BIGINT AS self_ns,
    sum(s.cpu_ns)::BIGINT AS total_ns,
    round(coalesce(sum(s.samples) FILTER (WHERE is_self), 0) / any_value(a.samples), 4)
        AS self_share,
    round(sum(s.samples) / any_value(a.samples), 4) AS total_share
FROM (
    SELECT
        s.*,
        k.stack_frame_id AS self_id
    FROM seen AS s
    JOIN main.stack AS k ON s.stack_id = k.stack_id
) AS s
JOIN within AS w ON s.stack_id = w.stack_id
JOIN whole AS a ON s.group_id IS NOT DISTINCT FROM a.group_id
CROSS JOIN LATERAL (SELECT s.self_id = w.stack_frame_id AS is_self)
GROUP BY s.group_id, w.stack_frame_id
