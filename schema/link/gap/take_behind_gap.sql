-- description: Takes and publications with a gap of their recording in between: what else the
--     thread took may be lost.
-- grain: one row per such take and publication
-- param: links VARCHAR  Name of rows of publication_id, take_id, trace_id, start_ns (of the
--     publication), taken_ns
CREATE OR REPLACE MACRO derive.take_behind_gap(links) AS TABLE
SELECT l.publication_id, l.take_id
FROM (
    SELECT n.publication_id, n.take_id, n.start_ns, n.taken_ns, x.recording_id
    FROM query_table(links) AS n
    JOIN derive.exposed_trace AS x ON n.trace_id = x.trace_id
) AS l
ASOF JOIN derive.recording_gap AS g ON l.recording_id = g.recording_id AND l.start_ns > g.start_ns
WHERE g.start_ns >= l.taken_ns OR g.covered_until_ns > l.taken_ns
