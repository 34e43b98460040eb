-- title: Patterns that load no event
-- description: Patterns of --events load nothing. Events of the kernel belong to no thread of a
--     process, and --ignore leaves events out. Patterns of what msgflow reads in any case are not
--     among these: such events are in tables of their own.
-- cause: The pattern is misspelt, such events were not recorded, they are none of a program's own,
--     or --ignore leaves them out.
-- cure: Compare it with the names that msgflow events TRACE --count lists. Record the events:
--     lttng enable-event -u 'my_pkg:*', or ros2 trace -u 'ros2:*' 'my_pkg:*'.
-- grain: one row, if there are any
-- severity: warning
-- when: staging.asked
WITH pattern AS (
    SELECT
        a.place,
        any_value(a.pattern) AS pattern,
        count(a.event) AS event_count,
        bool_or(i.event IS NOT NULL) AS is_left_out
    FROM staging.asked AS a
    LEFT JOIN staging.event_count AS e ON a.event = e.name
    LEFT JOIN staging.ignored AS i ON a.event = i.event
    GROUP BY a.place
    HAVING NOT coalesce(bool_or(e.is_known AND i.event IS NULL), false)
),
-- What the trace has instead.
other AS (
    SELECT
        e.name,
        sum(e.event_count)::BIGINT AS event_count
    FROM staging.event_count AS e
    JOIN staging.source AS s ON e.trace_index = s.trace_index
    ANTI JOIN staging.ignored AS i ON e.name = i.event
    WHERE NOT e.is_known AND s.domain IS DISTINCT FROM 'kernel'
    GROUP BY e.name
),
listed AS (
    SELECT string_agg(printf('%s (%d)', name, event_count), ', ' ORDER BY name) AS names FROM other
)
SELECT
    count(*) AS count,
    'patterns that load no event: '
    || string_agg(
        pattern
        || CASE
            WHEN event_count = 0 THEN ''
            WHEN is_left_out THEN ' (left out on request)'
            ELSE ' (of no thread)'
        END,
        ', ' ORDER BY place
    )
    || '; the traces have ' || coalesce((SELECT names FROM listed), 'no others to load') AS detail
FROM pattern
HAVING count(*) > 0
