-- title: What was lost on a path
-- description: Rows of topics --measure delivery, of subscriptions on the path that is explained.
-- grain: one row per subscription that missed messages
-- reads: losses
-- param: path VARCHAR  The path
FROM losses
WHERE list_contains(string_split($path, ' → '), coalesce(topic_name, '?'))
    AND list_contains(string_split($path, ' → '), subscriber)
    AND dropped + lost > 0
