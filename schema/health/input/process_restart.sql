-- title: Process ids that were used again
-- description: New processes have the ids of earlier ones. Each is a process of its own in the
--     database.
-- cause: Processes ended, and others were given their ids.
-- cure: None needed.
-- grain: one row, if there are any
-- severity: info
-- when: staging.process WHERE life > 1
SELECT
    count(*) AS count,
    'process ids that were used again by a new process: '
    || string_agg(label, ', ' ORDER BY process_id) AS detail
FROM process_label
WHERE life > 1
HAVING count(*) > 0
