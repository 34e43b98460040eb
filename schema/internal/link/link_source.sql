-- title: Indirect links by who declares them
-- description: How many indirect links of a run a file declares, and how many its trace.
-- grain: one row
-- column: of_file BIGINT  Links that a file declares
-- column: of_trace BIGINT  Links that the trace declares
SELECT
    count(*) FILTER (WHERE a.source = 'file') AS of_file,
    count(*) FILTER (WHERE a.source = 'trace') AS of_trace
FROM store.link_causal AS l
JOIN store.annotation AS a ON l.annotation_id = a.annotation_id
WHERE l.run_id = $run_id
