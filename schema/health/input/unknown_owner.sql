-- title: Callbacks without a known owner
-- description: The timer, service or subscription of callbacks that ran is not known.
-- cause: The session was started after the nodes, or the events of initialisation were not enabled
--     or lost.
-- cure: Start the session first, or record initialisation into a snapshot session that runs all the
--     time, and ingest both. Enable ros2:*, so that takes and executors show.
-- grain: one row, if there are any
-- severity: warning
-- when: staging.callback WHERE kind = 'unknown'
SELECT
    count(*) AS count,
    'callbacks whose timer, service or subscription is not known (no executor events, takes that '
    || 'were not recorded, or loaned messages), in '
    || string_agg(DISTINCT l.label, ', ' ORDER BY l.label) AS detail
FROM staging.callback AS c
JOIN process_label AS l ON c.process_id = l.process_id
WHERE c.kind = 'unknown' AND c.callback_id IN (SELECT callback_id FROM staging.callback_number)
HAVING count(*) > 0
