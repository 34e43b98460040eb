-- description: Samples of what threads ran, with their stacks.
-- grain: one row per sample of a thread that is known
SELECT
    at_ns, thread_id,
    coalesce(cpu, 0) AS cpu,
    stack_id
FROM main.stack_sample
WHERE run_id = $run_id AND at_ns >= $start_ns AND at_ns < $end_ns
    AND thread_id IS NOT NULL
ORDER BY at_ns, thread_id
