-- title: Messages of a topic are matched by time
-- description: The middleware has no event for publications of the topic, although nothing was
--     lost, so that they have no stamp. A message is of a publication if it was stamped before
--     the publishing thread went on; its link has the method nearest. Where several publications
--     come into question, the message has no link.
-- cause: Since Lyrical, rmw_zenoh writes messages with buffers, such as images and point clouds,
--     for each subscription on its own, without rmw_publish and each time with another stamp. Or
--     rmw_publish was not enabled.
-- cure: None needed with rmw_zenoh; where links by time are not enough, record with another
--     middleware. Otherwise enable all events of ROS (ros2:*).
-- grain: one row per topic
-- severity: info
-- when: store.nearest_message
SELECT
    $run_id AS run_id,
    p.topic_name,
    count(*) AS count,
    derive.counted(count(*), 'publication') AS detail
FROM derive.unstamped_call($run_id) AS b
JOIN store.publisher AS p ON b.publisher_id = p.publisher_id
WHERE b.is_without_event
    AND p.topic_name IN (SELECT topic_name FROM store.nearest_message WHERE run_id = $run_id)
GROUP BY p.topic_name
