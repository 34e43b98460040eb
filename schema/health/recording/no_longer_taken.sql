-- title: A subscription that took nothing more of a publisher
-- description: Until some moment the subscription took messages of the publisher. Later ones were
--     published, and the process of the subscription went on, but it took none. What became of them
--     is unknown (no_longer_taken).
-- cause: The subscription was destroyed (ROS has no event for that), the two lost their connection,
--     or the executor does not get to the subscription any more.
-- cure: None needed if the node destroys the subscription. Else see whether other callbacks keep
--     the executor busy (msgflow query executor-usage), and who is connected (ros2 topic info
--     --verbose).
-- grain: one row per topic, publishing node and subscribing node
-- severity: warning
-- when: store.undelivered WHERE reason = 'no_longer_taken'
SELECT
    run_id, node_id, publishing_node_id, topic_name, subject,
    number AS count,
    printf('none of the last %s was taken', messages) AS detail
FROM untaken_pair
-- A single message may get lost at any time.
WHERE reason = 'no_longer_taken' AND number > 1
