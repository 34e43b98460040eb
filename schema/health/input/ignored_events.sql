-- title: Events were left out on request
-- description: The run was ingested without some of the events that its traces hold. What they show
--     is missing from all results.
-- cause: The option --ignore of msgflow ingest.
-- cure: Ingest again without the option: msgflow ingest --replace TRACE.
-- grain: one row, if there are any
-- severity: warning
-- when: staging.ignored
WITH by_pattern AS (
    SELECT
        i.place, i.pattern,
        sum(e.event_count)::BIGINT AS event_count
    FROM staging.ignored AS i
    JOIN staging.event_count AS e ON i.event = e.name
    GROUP BY i.place, i.pattern
)
SELECT
    (
        SELECT sum(event_count)
        FROM staging.event_count
        WHERE name IN (SELECT event FROM staging.ignored)
    ) AS count,
    'events that were left out on request: '
    || string_agg(printf('%s (%d)', pattern, event_count), ', ' ORDER BY place) AS detail
FROM by_pattern
HAVING count(*) > 0
