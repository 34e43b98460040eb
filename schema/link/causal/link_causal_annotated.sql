-- description: Publications that messages led to which were kept until then, as annotations tell.
--     A link may be spoilt by lost events where a gap touches the callback instance that kept the
--     message, or the publication.
-- grain: one row per callback instance, publication that it led to, and annotation
-- when: store.annotation
CREATE OR REPLACE MACRO derive.link_causal_annotated(only_run) AS TABLE
WITH link AS (
    SELECT
        x.run_id, i.callback_instance_id,
        coalesce(i.take_id, -least(x.callback_instance_id, 0)) AS take_id,
        x.publication_id, b.publisher_id, x.kind, x.annotation_id, x.candidate_count,
        x.is_loss_affected OR coalesce(i.is_loss_affected, t.is_loss_affected)
        OR b.is_loss_affected AS is_loss_affected
    FROM derive.link_causal_indirect(only_run) AS x
    LEFT JOIN store.callback_instance AS i
        ON x.callback_instance_id = i.callback_instance_id AND i.run_id = only_run
    LEFT JOIN store.take AS t ON -x.callback_instance_id = t.take_id AND t.run_id = only_run
    JOIN store.publication AS b ON x.publication_id = b.publication_id
    WHERE b.run_id = only_run
)
FROM derive.causal_link(only_run, 'link')
