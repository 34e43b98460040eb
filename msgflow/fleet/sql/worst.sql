-- title: The flows of a path that took longest, of all runs
-- description: Flows that reached the end of the path, by their first arrival, with the recording
--     that each is in.
-- grain: one row per flow
-- param: path VARCHAR  The text of a path, a glob, or a part of it
-- param: count BIGINT {1..} = 10  Most rows
-- column: latency_ns, name
-- column: run VARCHAR         Key of the run
-- column: labels VARCHAR[]    Labels of the run, KEY=VALUE
-- column: root_ns, path
-- column: source VARCHAR      What it was read from
-- column: root_kind
-- column: root_id BIGINT      Identity of the root in the database of the run
-- brief: latency_ns, name, labels, run, root_ns, source
WITH fitting AS (
    SELECT run, path, root_kind, root_id, root_ns, latency_ns
    FROM flow
    WHERE status = 'reached' AND is_first
        AND (path = $path OR path GLOB $path OR contains(path, $path))
),
-- One path has exactly this name, or several have it in theirs.
wanted AS (
    SELECT *
    FROM fitting
    WHERE path = $path OR NOT EXISTS (SELECT 1 FROM fitting WHERE path = $path)
)
SELECT
    w.latency_ns, r.name, w.run,
    list_transform(map_entries(r.labels), lambda entry: entry.key || '=' || entry.value) AS labels,
    w.root_ns, w.path, r.source, w.root_kind, w.root_id
FROM wanted AS w
JOIN run AS r ON w.run = r.run
ORDER BY w.latency_ns DESC, w.run, w.path, w.root_ns, w.root_kind, w.root_id
LIMIT $count
