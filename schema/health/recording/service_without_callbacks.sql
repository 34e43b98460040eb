-- title: Services of actions whose callbacks have no events
-- description: The process took requests of these services and ran none of its callbacks with them,
--     as far as the trace shows. So these callbacks have no duration and no wait, and do not count
--     as use of the executor. What they publish and send is known all the same (link_call).
-- cause: They belong to an action: rclcpp_action runs its callbacks without events.
-- cure: None. Time them in the node, with a tracepoint of your own.
-- grain: one row per process that runs other callbacks
-- severity: info
-- when: store.request WHERE callback_instance_id IS NULL
WITH served AS (
    SELECT
        process_id, service_id,
        count(*) AS number
    FROM (
        SELECT s.process_id, q.service_id, q.callback_instance_id
        FROM store.request AS q
        JOIN store.service AS s ON q.service_id = s.service_id
        WHERE q.taken_ns IS NOT NULL
    )
    GROUP BY process_id, service_id
    HAVING count(callback_instance_id) = 0
)
SELECT
    s.run_id, v.process_id,
    sum(v.number)::BIGINT AS count,
    printf(
        '%s of %s', derive.counted(sum(v.number), 'request'),
        string_agg(s.service_name, ', ' ORDER BY s.service_name)
    ) AS detail
FROM served AS v
JOIN store.service AS s ON v.service_id = s.service_id
WHERE v.process_id IN (SELECT process_id FROM store.callback)
    AND contains(s.service_name, '/_action/')
GROUP BY s.run_id, v.process_id
