-- description: What messages go through: a topic of ROS 2, or one of Agnocast of the same name on
--     one kernel. Only a bridge passes messages on to another one.
CREATE OR REPLACE MACRO derive.own_topic(topic_name, is_agnocast, clock_id) AS
CASE WHEN is_agnocast THEN printf('agnocast %d %s', clock_id, topic_name) ELSE topic_name END
