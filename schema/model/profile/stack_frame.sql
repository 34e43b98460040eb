-- description: Functions that samples of stacks saw.
-- grain: one row per function and file
-- when: staging.stack_text
SELECT
    row_number() OVER (ORDER BY call) AS stack_frame_id,
    call.function, call.file, call
FROM (SELECT DISTINCT unnest(calls) AS call FROM staging.stack_text)
