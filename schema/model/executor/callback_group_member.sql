-- description: Callbacks of the callback groups.
-- grain: one row per callback in a callback group
-- when: staging.callback_group_entry
SELECT g.callback_group_id, e.callback_id
FROM staging.callback_group_entry AS e
JOIN staging.callback_group AS g ON e.group_event_id = g.event_id
ORDER BY e.callback_id
