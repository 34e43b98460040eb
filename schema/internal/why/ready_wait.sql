-- title: When inputs of callbacks became ready
-- description: What an explanation looks at twice: how long all callbacks waited, and what one flow
--     waited for.
-- grain: one row per callback instance that is not nested in another
WITH executor AS (
    SELECT
        executor_id,
        NULL::BIGINT AS until_ns
    FROM derive.executor_size
    WHERE list_contains($runs, run_id)
)
FROM derive.callback_ready('executor', $has_calls, $has_teams)
