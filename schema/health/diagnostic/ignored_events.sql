-- name: diagnostic.ignored_events
-- title: Events that were left out on request
-- description: Events that a pattern of --ignore matches were not loaded.
-- finding: ignored_events
-- grain: one row, if there are any
-- severity: info
-- phase: reading
WITH by_pattern AS (
    SELECT i.place, i.pattern, sum(e.event_count)::BIGINT AS event_count
    FROM staging.ignored AS i
    JOIN staging.event_count AS e ON i.event = e.name
    GROUP BY i.place, i.pattern
)
SELECT
    NULL AS trace_id,
    (
        SELECT sum(event_count)
        FROM staging.event_count
        WHERE name IN (SELECT event FROM staging.ignored)
    ) AS count,
    'events that were left out on request: '
    || string_agg(printf('%s (%d)', pattern, event_count), ', ' ORDER BY place) AS detail
FROM by_pattern
HAVING count(*) > 0
