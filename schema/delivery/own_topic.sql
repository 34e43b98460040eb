-- name: derive.own_topic
-- kind: macro
-- description: What messages go through: a topic of ROS 2, or one of Agnocast of the same name,
--     whose messages only a bridge passes on to the other.
CREATE OR REPLACE MACRO derive.own_topic(topic_name, is_agnocast) AS
CASE WHEN is_agnocast THEN 'agnocast ' || topic_name ELSE topic_name END
