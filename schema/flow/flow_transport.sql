-- description: Messages handed over on the topics of the application, with both objects. ROS's own
--     topics, self loops and copies that no callback gets are no part of a path. A row is ambiguous
--     where another publication may have been taken instead.
--     Messages of publishers that are not traced have ids below 0 (derive.flow_root).
-- grain: one row per take whose publication is known, or whose publisher is not traced
SELECT
    l.run_id, l.publication_id, l.publisher_id, l.take_id, l.subscription_id,
    coalesce(l.candidate_count > 1, false) AS is_ambiguous
FROM store.link_transport AS l
JOIN store.publisher AS p ON l.publisher_id = p.publisher_id
JOIN store.subscription AS s ON l.subscription_id = s.subscription_id
WHERE NOT l.is_self_loop AND l.is_copy IS NOT TRUE AND NOT p.is_internal AND NOT s.is_internal
UNION ALL
SELECT
    run_id, publication_id, publisher_id, root_id,
    -publisher_id,
    false
FROM store.flow_root
WHERE root_kind = 'take'
