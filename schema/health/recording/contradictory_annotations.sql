-- title: Annotations that contradict each other
-- description: Inputs and outputs that two annotations declare as links of different kinds:
--     periodic_async, partial_sync, approximate_sync or queue. They use the messages in different
--     ways, and both count. Or one declares them direct, and another independent, which counts.
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
    SELECT DISTINCT
        p.run_id, p.subscription_id, p.publisher_id, p.kind,
        s.kind AS other
    FROM derive.declared_pair AS p
    JOIN derive.declared_pair AS s
        ON p.subscription_id = s.subscription_id AND p.publisher_id = s.publisher_id
    WHERE (derive.is_indirect(p.kind) AND derive.is_indirect(s.kind) AND p.kind > s.kind)
        OR (p.kind = 'direct' AND s.kind = 'independent')
) AS c
LEFT JOIN store.subscription AS s ON c.subscription_id = s.subscription_id
LEFT JOIN store.publisher AS p ON c.publisher_id = p.publisher_id
GROUP BY c.run_id
