-- title: Runs, as the page of a lake needs them
-- description: The chosen runs in the order of their time.
-- grain: one row per run
-- column: run, name
-- column: began VARCHAR       Start of the run, UTC
-- column: start_s DOUBLE      The same in seconds since the epoch
-- column: labels VARCHAR[]    Labels, KEY=VALUE
-- column: event_count, source
-- column: has_database BOOLEAN  The lake has its database
SELECT
    run, name,
    strftime(make_timestamp(start_ns // 1000), '%Y-%m-%d %H:%M:%S') AS began,
    start_ns / 1e9 AS start_s,
    list_transform(map_entries(labels), lambda entry: entry.key || '=' || entry.value) AS labels,
    event_count, source,
    database_part IS NOT NULL AS has_database
FROM run
ORDER BY start_ns, run
