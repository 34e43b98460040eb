-- name: derive.compared_callback
-- kind: macro
-- description: Durations of callbacks by node and what triggers them, which is the same in other
--     runs of a system.
-- grain: one row per run of a callback
-- param: runs BIGINT[]  Runs to look at
-- needs: main.callback_instance, main.callback_label
CREATE OR REPLACE MACRO derive.compared_callback(runs) AS TABLE
SELECT
    i.run_id,
    l.node || ' · ' || l.label AS subject,
    l.is_internal,
    i.start_ns AS at_ns,
    i.callback_instance_id AS id,
    i.end_ns - i.start_ns AS value_ns,
    true AS is_unit,
    i.end_ns IS NOT NULL AS is_complete
FROM main.callback_instance AS i
JOIN main.callback_label AS l ON i.callback_id = l.callback_id
WHERE list_contains(runs, i.run_id)
