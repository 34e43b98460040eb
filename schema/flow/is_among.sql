-- name: derive.is_among
-- kind: macro
-- description: Whether a topic or a node is among those that a text names: names or patterns (GLOB)
--     of either, separated by commas.
CREATE OR REPLACE MACRO derive.is_among(patterns, topic_name, node_name) AS
coalesce(
    list_bool_or(list_transform(
        string_split(patterns::VARCHAR, ','),
        lambda each: coalesce(topic_name = trim(each) OR topic_name GLOB trim(each), false)
            OR coalesce(node_name = trim(each) OR node_name GLOB trim(each), false)
    )),
    false
)
