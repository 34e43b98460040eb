-- title: A call has several causes, or none
-- description: What a thread sent after a taken request or response has one cause, and is one
--     message.
-- cause: A mistake in msgflow, or input that it misunderstands.
-- cure: Report what msgflow check --detail prints, together with the trace.
-- grain: one row per run with such rows
-- severity: error
WITH call AS (
    SELECT
        run_id, publication_id, request_id, response_id,
        list_count([taken_request_id, taken_response_id]) AS cause_count,
        list_count([publication_id, request_id, response_id]) AS effect_count
    FROM store.link_call
),
wrong AS (
    SELECT run_id FROM call WHERE cause_count <> 1 OR effect_count <> 1
    UNION ALL
    SELECT run_id
    FROM call
    WHERE cause_count = 1 AND effect_count = 1
    GROUP BY run_id, publication_id, request_id, response_id
    HAVING count(*) > 1
)
SELECT run_id, count(*) AS count, 'links without just one cause and one effect' AS detail
FROM wrong
GROUP BY run_id
