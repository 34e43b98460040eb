-- title: Messages that several publications could have been
-- description: The publication of a message was chosen among several. Flows follow it all the same:
--     paths and latencies count it in their column ambiguous.
-- cause: Messages carry no stamp of their publication, or several have the same one.
-- cure: Leave out links with a candidate_count above 1 where only certain ones are to count.
-- grain: one row per node
-- severity: warning
-- when: store.link_transport WHERE candidate_count > 1
SELECT
    l.run_id, s.process_id, s.node_id,
    count(*) AS count,
    printf(
        '%s on %s may be of other publications',
        derive.counted(count(*), 'message'),
        string_agg(DISTINCT coalesce(s.topic_name, '?'), ', ' ORDER BY coalesce(s.topic_name, '?'))
    ) AS detail
FROM store.link_transport AS l
LEFT JOIN store.subscription AS s ON l.subscription_id = s.subscription_id
WHERE l.candidate_count > 1
GROUP BY l.run_id, s.process_id, s.node_id
