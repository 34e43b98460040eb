-- description: Publications with a gap of their recording between their begin and the next event
--     of their thread, or, where there is no next event, until a message is surely written. The
--     event that says who sent the message may be lost.
-- grain: one row per such publication
-- param: publications VARCHAR  Name of rows of publication_id
CREATE OR REPLACE MACRO derive.publication_beside_gap(publications) AS TABLE
SELECT p.publication_id
FROM (
    SELECT
        b.publication_id, b.start_ns, x.recording_id,
        coalesce(b.next_event_ns, b.end_ns + derive.clock_limit().write_ns) AS until_ns
    FROM store.publication AS b
    JOIN derive.exposed_trace AS x ON b.trace_id = x.trace_id
    WHERE b.publication_id IN (SELECT publication_id FROM query_table(publications))
) AS p
ASOF JOIN derive.recording_gap AS g ON p.recording_id = g.recording_id AND p.until_ns >= g.start_ns
WHERE g.covered_until_ns >= p.start_ns
