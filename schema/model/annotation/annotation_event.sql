-- description: Annotations of indirect links, as often as they were made.
-- grain: one row per message_link event
-- when: raw.ros2_message_link_approximate_sync, raw.ros2_message_link_partial_sync,
--     raw.ros2_message_link_periodic_async
SELECT event_id, process_id, 'periodic_async' AS kind, subs AS inputs, pubs AS outputs
FROM staging.located('ros2_message_link_periodic_async')
UNION ALL
SELECT event_id, process_id, 'partial_sync', subs, pubs
FROM staging.located('ros2_message_link_partial_sync')
UNION ALL
SELECT event_id, process_id, 'approximate_sync', subs, pubs
FROM staging.located('ros2_message_link_approximate_sync')
