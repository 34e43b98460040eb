-- description: Stacks of calls, with the function that ran.
-- grain: one row per different stack
-- when: staging.stack_text
SELECT
    row_number() OVER (ORDER BY s.calls) AS stack_id,
    f.stack_frame_id,
    len(s.calls)::INTEGER AS depth,
    s.calls
FROM (
    SELECT
        calls,
        max(ran) AS ran
    FROM staging.stack_text
    GROUP BY calls
) AS s
JOIN staging.stack_frame AS f ON s.calls[s.ran] = f.call
