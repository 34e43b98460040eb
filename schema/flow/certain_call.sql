-- description: What flows follow of the calls that threads make without a callback. Left out are
--     those that the thread may have made by itself, and those of processes that are several.
-- grain: one row per such call that is followed
SELECT
    run_id,
    CASE WHEN taken_request_id IS NULL THEN 'response' ELSE 'request' END AS from_kind,
    coalesce(taken_request_id, taken_response_id) AS from_id,
    CASE
        WHEN publication_id IS NOT NULL THEN 'publication'
        WHEN request_id IS NOT NULL THEN 'request'
        ELSE 'response'
    END AS to_kind,
    coalesce(publication_id, request_id, response_id) AS to_id,
    taken_request_id, taken_response_id, publication_id, publisher_id, request_id, response_id
FROM store.link_call
WHERE candidate_count = 1
