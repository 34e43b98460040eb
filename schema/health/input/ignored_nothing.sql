-- title: Patterns that match no event
-- description: Patterns of --ignore match no event that the traces hold.
-- cause: The pattern is misspelt, or such events were not recorded.
-- cure: Compare it with the names that msgflow events TRACE lists.
-- grain: one row, if there are any
-- severity: warning
-- when: staging.ignored
SELECT
    count(*) AS count,
    'patterns of events to leave out that match none: '
    || string_agg(pattern, ', ' ORDER BY place) AS detail
FROM staging.ignored
WHERE event IS NULL
HAVING count(*) > 0
