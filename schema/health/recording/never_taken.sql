-- title: A subscription that took no message of a publisher
-- description: Publisher and subscription of a topic were both recorded, but not one message was
--     taken, nor by another subscription of the same node. These messages count as not connected
--     (never_taken), not as lost. Topics of ROS itself are not looked at.
-- cause: The two are in different ROS domains (ROS_DOMAIN_ID is not in a trace), their QoS does not
--     match (a best-effort publisher, a reliable subscription), they never discovered each other,
--     or the node of the subscription does not spin.
-- cure: ros2 topic info --verbose says who is connected, with which QoS. Compare ROS_DOMAIN_ID and
--     RMW_IMPLEMENTATION of both, and see that the node is in an executor that spins.
-- grain: one row per topic, publishing node and subscribing node
-- severity: warning
-- when: store.undelivered WHERE reason = 'never_taken'
SELECT
    run_id, node_id, publishing_node_id, topic_name, subject,
    number AS count,
    printf('none of %s was taken', messages) AS detail
FROM untaken_pair
WHERE reason = 'never_taken' AND taken = 0
