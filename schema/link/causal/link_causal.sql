-- description: Which callback instance made each publication. Lost events may spoil a link where a
--     gap touches the instance or the publication. What a client does with a response that it takes
--     inside of another callback follows from the response (derive.link_call). Of
--     what a job publishes again (derive.job_again) there are two candidates.
-- grain: one row per publication made by a callback instance
-- also: derive.link_causal_by_hand, derive.link_causal_annotated
CREATE OR REPLACE MACRO derive.link_causal(only_run) AS TABLE
WITH link AS (
    SELECT
        d.run_id, d.callback_instance_id, d.take_id, d.publication_id, d.publisher_id,
        'direct' AS kind,
        NULL::BIGINT AS annotation_id,
        greatest(
            d.candidate_count, CASE WHEN j.publication_id IS NOT NULL THEN 2 END
        ) AS candidate_count,
        d.is_loss_affected
    FROM derive.link_causal_direct(only_run) AS d
    LEFT JOIN derive.job_again(only_run) AS j ON d.publication_id = j.publication_id
    ANTI JOIN (FROM store.link_call WHERE run_id = only_run) AS l
        ON d.publication_id = l.publication_id
)
FROM derive.causal_link(only_run, 'link')
