-- name: diagnostic.eliminated_owner
-- title: Callbacks attributed by elimination
-- description: Timers and services that callbacks belong to were deduced from how executors ran
--     them.
-- finding: uncertain_owner
-- grain: one row, if there are any
-- severity: warning
-- phase: model
SELECT
    NULL AS trace_id,
    count(*) AS count,
    'callbacks attributed to timers or services by elimination: their initialisation was not '
    || 'traced, and executors ran them without a take; subscriptions of loaned messages would look '
    || 'like timers, in ' || string_agg(DISTINCT l.label, ', ' ORDER BY l.label) AS detail
FROM staging.callback_owner AS o
JOIN process_label AS l ON o.process_id = l.process_id
WHERE o.is_eliminated
HAVING count(*) > 0
