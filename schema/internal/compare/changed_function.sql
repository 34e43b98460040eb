-- description: In which functions a callback was more or less CPU time per call than in another
--     run, what they call not counted. Only callbacks that samples of perf saw in both, and
--     differences beyond what is chance in so few samples (three standard deviations).
-- grain: one row per callback and function, the greatest difference first
-- param: run_a, run_b, at_least, skip_first, a_window, b_window
WITH instance AS (
    SELECT
        side = 'a' AS is_a,
        node, label, callback_instance_id
    FROM compared_instance
),
sample AS (
    SELECT i.is_a, i.node, i.label, f.function, s.cpu_ns
    FROM instance AS i
    JOIN main.stack_sample AS s ON i.callback_instance_id = s.callback_instance_id
    JOIN main.stack AS k ON s.stack_id = k.stack_id
    JOIN main.stack_frame AS f ON k.stack_frame_id = f.stack_frame_id
),
call AS (
    SELECT
        node, label,
        count(*) FILTER (WHERE is_a) AS a_calls,
        count(*) FILTER (WHERE NOT is_a) AS b_calls
    FROM instance
    WHERE (node, label) IN (
        SELECT (node, label) FROM sample GROUP BY node, label HAVING count(DISTINCT is_a) = 2
    )
    GROUP BY node, label
),
compared AS (
    SELECT
        c.node, c.label, s.function,
        coalesce(sum(s.cpu_ns) FILTER (WHERE s.is_a), 0) / any_value(c.a_calls) AS a_ns,
        coalesce(sum(s.cpu_ns) FILTER (WHERE NOT s.is_a), 0) / any_value(c.b_calls) AS b_ns,
        count(*) FILTER (WHERE s.is_a) AS a_samples,
        count(*) FILTER (WHERE NOT s.is_a) AS b_samples,
        -- The number of samples in a function varies by its square root.
        3 * sqrt(
            a_samples * pow(avg(s.cpu_ns) / any_value(c.a_calls), 2)
            + b_samples * pow(avg(s.cpu_ns) / any_value(c.b_calls), 2)
        ) AS chance_ns
    FROM call AS c
    JOIN sample AS s ON c.node = s.node AND c.label = s.label
    GROUP BY c.node, c.label, s.function
)
SELECT
    node,
    label AS callback,
    function,
    round(a_ns)::BIGINT AS a_ns,
    round(b_ns)::BIGINT AS b_ns,
    a_samples, b_samples
FROM compared
WHERE abs(b_ns - a_ns) > greatest(chance_ns, $at_least * a_ns)
ORDER BY abs(b_ns - a_ns) DESC, node, callback, function
