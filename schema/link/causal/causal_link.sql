-- description: Causal links as they are stored. In a process that is several with equal ids, the
--     cause may be one of another process, so there is one candidate more. Annotations take links
--     away. `independent` says that a publisher does not answer a subscription: links of the kinds
--     `direct` and `take_adjacent` go. `approximate_sync` says that it waits for the messages
--     closest in time: links of the kind `direct` go. Where messages are said to be kept,
--     `take_adjacent` is no longer a guess worth making.
-- grain: one row per link that is not declared away
-- param: links VARCHAR  Name of rows of run_id, callback_instance_id, take_id, publication_id,
--     publisher_id, kind, annotation_id, candidate_count, is_loss_affected
CREATE OR REPLACE MACRO derive.causal_link(only_run, links) AS TABLE
SELECT
    l.run_id, l.callback_instance_id, l.publication_id, l.take_id, t.subscription_id,
    l.publisher_id, l.kind, l.annotation_id,
    greatest(
        l.candidate_count, CASE WHEN m.publication_id IS NOT NULL THEN 2 END
    ) AS candidate_count,
    coalesce(l.is_loss_affected, false) AS is_loss_affected
FROM query_table(links) AS l
LEFT JOIN store.take AS t ON l.take_id = t.take_id AND t.run_id = only_run
LEFT JOIN derive.mixed_publication(only_run) AS m ON l.publication_id = m.publication_id
ANTI JOIN (
    SELECT
        subscription_id, publisher_id,
        unnest(
            CASE kind
                WHEN 'independent' THEN ['direct', 'take_adjacent']
                WHEN 'approximate_sync' THEN ['direct']
                ELSE ['take_adjacent']
            END
        ) AS kind
    FROM derive.declared_pair
    WHERE run_id = only_run
        AND kind IN ('independent', 'approximate_sync', 'periodic_async', 'queue')
) AS d
    ON l.kind = d.kind AND t.subscription_id = d.subscription_id AND l.publisher_id = d.publisher_id
