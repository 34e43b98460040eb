-- name: finding.contradictory_annotations
-- title: Annotations that contradict each other
-- description: Inputs and outputs that one annotation declares periodic_async, and another
--     partial_sync: the caches would be emptied by one, and kept by the other, and both count. Or
--     one declares them direct, and another independent, which counts.
-- cause: A file of links declares one, the trace or another entry of the file the other.
-- cure: Take the wrong one out of the file (msgflow links apply FILE), or out of the node.
-- grain: one row per run
-- severity: warning
-- when: store.annotation
SELECT
    c.run_id,
    count(*) AS count,
    'inputs and outputs that are declared in two ways: '
    || string_agg(
        printf(
            '%s → %s (%s and %s)', coalesce(s.topic_name, '?'), coalesce(p.topic_name, '?'), c.kind,
            c.other
        ),
        ', ' ORDER BY s.topic_name, p.topic_name, c.subscription_id, c.publisher_id, c.kind
    ) AS detail
FROM (
    SELECT DISTINCT p.run_id, p.subscription_id, p.publisher_id, p.kind, s.kind AS other
    FROM declared_pair AS p
    JOIN declared_pair AS s
        ON p.subscription_id = s.subscription_id AND p.publisher_id = s.publisher_id
    WHERE (p.kind = 'periodic_async' AND s.kind = 'partial_sync')
        OR (p.kind = 'direct' AND s.kind = 'independent')
) AS c
LEFT JOIN store.subscription AS s ON c.subscription_id = s.subscription_id
LEFT JOIN store.publisher AS p ON c.publisher_id = p.publisher_id
GROUP BY c.run_id
