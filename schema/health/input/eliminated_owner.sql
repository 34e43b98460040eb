-- title: Callbacks attributed by elimination
-- description: Timers and services that callbacks belong to were deduced from how executors ran
--     them.
-- cause: The session was started after the nodes, or the events of initialisation were not enabled
--     or lost.
-- cure: Start the session first, or record initialisation into a snapshot session that runs all the
--     time, and ingest both. Enable ros2:*, so that takes and executors show.
-- grain: one row, if there are any
-- severity: warning
-- when: staging.callback_owner WHERE is_eliminated
SELECT
    count(*) AS count,
    'callbacks attributed to timers or services by elimination: their initialisation was not '
    || 'traced, and executors ran them without a take; subscriptions of loaned messages would look '
    || 'like timers, in ' || string_agg(DISTINCT l.label, ', ' ORDER BY l.label) AS detail
FROM staging.callback_owner AS o
JOIN process_label AS l ON o.process_id = l.process_id
WHERE o.is_eliminated
HAVING count(*) > 0
