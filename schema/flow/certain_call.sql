-- name: derive.certain_call
-- description: What flows follow of the calls that threads make without a callback. Left out are
--     those that the thread may have made by itself, and those of processes that are several.
-- grain: one row per such call that is followed
SELECT
    run_id, taken_request_id, taken_response_id, publication_id, publisher_id, request_id,
    response_id, candidate_count
FROM store.link_call
WHERE candidate_count = 1
