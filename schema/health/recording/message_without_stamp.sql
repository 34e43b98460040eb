-- title: Messages cannot be followed, because they have no stamp
-- description: Subscriptions got messages without a stamp, so that their publication cannot be
--     identified, and no gap of the trace explains it. Their flows begin at the take. For
--     publications of the topic it is not known whether these subscriptions took them.
-- cause: Loaned messages, and intra-process messages before Iron, reach callbacks without an event
--     for the message; or the events of taking (rmw_take) were not enabled.
-- cure: Enable all events of ROS (ros2:*). For topics that matter, record with loaned messages and
--     intra-process communication off.
-- grain: one row per topic
-- severity: warning
-- when: store.orphan_take WHERE reason = 'no_stamp'
SELECT
    o.run_id, s.topic_name,
    coalesce(s.topic_name, 'unknown topic') AS subject,
    count(*) AS count,
    derive.counted(count(*), 'message') AS detail
FROM main.stat_orphan AS o
JOIN main.take AS t ON o.take_id = t.take_id
LEFT JOIN main.subscription AS s ON o.subscription_id = s.subscription_id
-- What a ring buffer keeps for those who come late has no publication to be found.
WHERE o.reason = 'no_stamp' AND t.method <> 'ring_buffer' AND NOT coalesce(s.is_internal, false)
GROUP BY o.run_id, s.topic_name
