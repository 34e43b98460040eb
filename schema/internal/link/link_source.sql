-- description: How many indirect links of a run a file declares, and how many its trace.
-- grain: one row
SELECT
    count(*) FILTER (WHERE a.source = 'file') AS of_file,
    count(*) FILTER (WHERE a.source = 'trace') AS of_trace
FROM store.link_causal AS l
JOIN store.annotation AS a ON l.annotation_id = a.annotation_id
WHERE l.run_id = $run_id
