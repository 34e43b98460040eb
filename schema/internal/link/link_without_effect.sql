-- description: The indirect links that a file declared for a run and that no message took, with the
--     reason.
-- grain: one row per such annotation
WITH declared AS (
    SELECT a.annotation_id, a.kind
    FROM store.annotation AS a
    ANTI JOIN (FROM store.link_causal WHERE run_id = $run_id) AS l
        ON a.annotation_id = l.annotation_id
    WHERE a.run_id = $run_id AND a.source = 'file' AND derive.is_indirect(a.kind)
),
input AS (
    SELECT
        i.annotation_id,
        string_agg(DISTINCT s.topic_name, ' and ' ORDER BY s.topic_name) AS topics,
        min(r.start_event_id) AS first_event_id
    FROM store.annotation_input AS i
    JOIN store.subscription AS s ON i.subscription_id = s.subscription_id
    LEFT JOIN derive.annotated_run($run_id) AS r ON i.subscription_id = r.subscription_id
    GROUP BY i.annotation_id
),
output AS (
    SELECT
        o.annotation_id,
        string_agg(DISTINCT p.topic_name, ' and ' ORDER BY p.topic_name) AS topics,
        max(b.start_event_id) AS last_event_id,
        count(b.publication_id) AS number,
        count(i.subscription_id) AS own_count
    FROM store.annotation_output AS o
    JOIN store.publisher AS p ON o.publisher_id = p.publisher_id
    LEFT JOIN derive.annotated_publication($run_id) AS b
        ON o.annotation_id = b.annotation_id AND o.publisher_id = b.publisher_id
    LEFT JOIN store.annotation_input AS i
        ON b.annotation_id = i.annotation_id AND b.subscription_id = i.subscription_id
    GROUP BY o.annotation_id
)
SELECT
    d.kind,
    i.topics AS inputs,
    o.topics AS outputs,
    CASE
        WHEN i.first_event_id IS NULL THEN printf('no message on %s was taken', i.topics)
        WHEN o.number = 0 THEN printf('nothing was published on %s', o.topics)
        WHEN o.last_event_id < i.first_event_id THEN
            printf('the first message on %s came after the last one on %s', i.topics, o.topics)
        WHEN d.kind IN ('periodic_async', 'queue') AND o.own_count = o.number THEN
            printf('callbacks of %s publish all of it: that is known without it', i.topics)
        WHEN d.kind IN ('partial_sync', 'approximate_sync') AND o.own_count = 0 THEN
            printf('no callback of an input was seen to publish on %s', o.topics)
        ELSE 'there was never a message for it, or the recording has a gap in between'
    END AS reason
FROM declared AS d
JOIN input AS i ON d.annotation_id = i.annotation_id
JOIN output AS o ON d.annotation_id = o.annotation_id
ORDER BY d.annotation_id
