-- description: Publications that annotations explain. One is complete if every input has a message:
--     an indirect link comes from it, or the publishing callback instance was called with it. For
--     partial_sync and approximate_sync: only publications from callback instances of inputs; all
--     of one instance are one firing.
-- grain: one row per annotation and publication that it applies to
-- column: run_id
-- column: annotation_id BIGINT  The annotation
-- column: publication_id
-- column: callback_instance_id BIGINT  Callback instance that published; NULL: none
-- column: input_count BIGINT  Inputs of the annotation
-- column: linked_count BIGINT  Inputs with a message
-- column: is_complete BOOLEAN  Every input has a message
WITH input AS (
    SELECT
        annotation_id,
        count(*) AS number
    FROM store.annotation_input
    GROUP BY annotation_id
),
linked AS (
    SELECT
        annotation_id, publication_id,
        count(*) AS number
    FROM store.link_causal
    WHERE annotation_id IS NOT NULL
    GROUP BY annotation_id, publication_id
),
direct AS (
    SELECT
        l.publication_id, l.callback_instance_id,
        coalesce(c.subscription_id, l.subscription_id) AS subscription_id
    FROM store.link_causal AS l
    JOIN store.callback_instance AS i ON l.callback_instance_id = i.callback_instance_id
    JOIN store.callback AS c ON i.callback_id = c.callback_id
    WHERE l.kind = 'direct' AND l.publisher_id IN (SELECT publisher_id FROM store.annotation_output)
),
firing AS (
    SELECT
        a.run_id, a.annotation_id, b.publication_id, d.callback_instance_id,
        (i.annotation_id IS NOT NULL)::BIGINT AS own_number
    FROM store.annotation AS a
    JOIN store.annotation_output AS o ON a.annotation_id = o.annotation_id
    JOIN store.publication AS b ON o.publisher_id = b.publisher_id
    LEFT JOIN direct AS d ON b.publication_id = d.publication_id
    LEFT JOIN store.annotation_input AS i
        ON a.annotation_id = i.annotation_id AND d.subscription_id = i.subscription_id
    WHERE a.kind IN ('periodic_async', 'queue')
        OR (a.kind = 'partial_sync' AND i.annotation_id IS NOT NULL)
    UNION ALL
    -- Its own message is one of the set, or none: there is no direct link.
    SELECT a.run_id, a.annotation_id, b.publication_id, i.callback_instance_id, 0
    FROM store.annotation AS a
    JOIN store.annotation_output AS o ON a.annotation_id = o.annotation_id
    JOIN store.publication AS b ON o.publisher_id = b.publisher_id
    JOIN store.callback_instance AS i
        ON b.callback_event_id = i.start_event_id AND b.run_id = i.run_id
    JOIN store.callback AS c ON i.callback_id = c.callback_id
    JOIN store.annotation_input AS n
        ON a.annotation_id = n.annotation_id AND c.subscription_id = n.subscription_id
    WHERE a.kind = 'approximate_sync' AND b.start_event_id < i.effective_end_event_id
)
SELECT
    f.run_id, f.annotation_id, f.publication_id, f.callback_instance_id,
    coalesce(n.number, 0) AS input_count,
    coalesce(l.number, 0) + f.own_number AS linked_count,
    linked_count = input_count AS is_complete
FROM firing AS f
LEFT JOIN input AS n ON f.annotation_id = n.annotation_id
LEFT JOIN linked AS l ON f.annotation_id = l.annotation_id AND f.publication_id = l.publication_id
