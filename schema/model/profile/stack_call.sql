-- description: The calls of each stack.
-- grain: one row per stack and call in it
-- when: staging.stack
WITH call AS (
    SELECT
        stack_id,
        unnest(range(1, len(calls) + 1))::INTEGER AS position,
        unnest(calls) AS call
    FROM staging.stack
)
SELECT c.stack_id, c.position, f.stack_frame_id
FROM call AS c
JOIN staging.stack_frame AS f ON c.call = f.call
ORDER BY c.stack_id, c.position
