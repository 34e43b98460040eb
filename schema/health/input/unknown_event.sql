-- title: Events that are not in the catalogue
-- description: Events of names that say nothing about ROS 2. They were not loaded.
-- cause: The session had events of other programs or of the kernel enabled, or those of another
--     version of ROS 2.
-- cure: None needed; msgflow events TRACE shows them, and msgflow ingest --events loads those of
--     your own (docs/own-events.md).
-- grain: one row per trace with such events
-- severity: info
-- when: staging.event_count WHERE NOT is_known
SELECT
    e.trace_index + 1 AS trace_id,
    sum(e.event_count) AS count,
    'events that are not in the catalogue and were not loaded: '
    || CASE
        WHEN s.domain = 'kernel' THEN printf('kernel events of %d names', count(*))
        ELSE string_agg(printf('%s (%d)', e.name, e.event_count), ', ' ORDER BY e.name)
    END AS detail
FROM staging.event_count AS e
JOIN staging.source AS s ON e.trace_index = s.trace_index
WHERE NOT e.is_known
GROUP BY e.trace_index, s.domain
