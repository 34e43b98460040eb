-- name: derive.causal_link
-- kind: macro
-- description: Causal links as they are stored. In a process that is several with equal ids, the
--     cause may be one of another process, so there is one candidate more. Annotations may declare
--     that a publisher does not answer a subscription (`independent`): then there is no link of the
--     kinds `direct` and `take_adjacent`. Or that it waits for the messages closest in time
--     (`approximate_sync`): then there is none of the kind `direct`.
-- grain: one row per link that is not declared away
-- param: only_run BIGINT  Run to look at
-- param: links VARCHAR  Name of rows of run_id, callback_instance_id, take_id, publication_id,
--     publisher_id, kind, annotation_id, candidate_count, is_loss_affected
CREATE OR REPLACE MACRO derive.causal_link(only_run, links) AS TABLE
WITH mixed AS (
    SELECT publication_id
    FROM store.publication
    WHERE run_id = only_run
        AND process_id IN (SELECT process_id FROM store.process WHERE is_ambiguous)
)
SELECT
    l.run_id,
    l.callback_instance_id,
    l.publication_id,
    l.take_id,
    t.subscription_id,
    l.publisher_id,
    l.kind,
    l.annotation_id,
    greatest(
        l.candidate_count, CASE WHEN m.publication_id IS NOT NULL THEN 2 END
    ) AS candidate_count,
    coalesce(l.is_loss_affected, false) AS is_loss_affected
FROM query_table(links) AS l
LEFT JOIN store.take AS t ON l.take_id = t.take_id AND t.run_id = only_run
LEFT JOIN mixed AS m ON l.publication_id = m.publication_id
ANTI JOIN (
    SELECT
        i.subscription_id, o.publisher_id,
        unnest(
            CASE a.kind WHEN 'independent' THEN ['direct', 'take_adjacent'] ELSE ['direct'] END
        ) AS kind
    FROM store.annotation AS a
    JOIN store.annotation_input AS i ON a.annotation_id = i.annotation_id
    JOIN store.annotation_output AS o ON a.annotation_id = o.annotation_id
    WHERE a.run_id = only_run AND a.kind IN ('independent', 'approximate_sync')
) AS d
    ON l.kind = d.kind
    AND t.subscription_id = d.subscription_id
    AND l.publisher_id = d.publisher_id
