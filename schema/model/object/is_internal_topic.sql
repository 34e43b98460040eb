-- description: Whether a topic is infrastructure of ROS rather than of the application.
CREATE OR REPLACE MACRO staging.is_internal_topic(topic_name) AS
coalesce(
    topic_name IN ('/rosout', '/parameter_events', 'ros_discovery_info')
    OR topic_name LIKE '%/transition\_event' ESCAPE '\',
    false
)
