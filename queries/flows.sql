-- title: Flows, one by one
-- description: Every flow: when the callback or publication that begins it (its root) started, and
--     when the end of the path was reached and how long that took, or why it was not.
-- grain: one row per path and root, or per pair of root and arrival
-- like: e2e-latency, main.end_to_end
-- reads: path_outcome, named_path
-- param: from, to, from_event, to_event, case
-- param: max_depth BIGINT {1..} = 32     Longest path, in topics
-- param: max_paths
-- column: run_id, root_kind, root_id, root_ns
-- column: take_id BIGINT           Take at the end of the path; empty: not reached
-- column: sink_ns
-- column: latency_ns BIGINT [ns]   From the start of the root to the end; empty: not reached, or a
--     message on the way was stored until its subscription existed
-- column: status VARCHAR           'reached', 'superseded', 'dropped', 'lost', 'no_output',
--     'not_connected', 'cut_by_recording' or 'unknown'
-- column: reason VARCHAR           Why it did not arrive
-- column: is_ambiguous BOOLEAN     It passes a link that may be another one (a candidate_count
--     above 1), so that it may be none
-- column: is_cut, path
-- column: size_bytes BIGINT [bytes]  Size of the message at the end; empty: no bag has it
-- column: age_from_stamp_ns BIGINT [ns]  From header.stamp of the message at the end, which nodes
--     pass on from the sensor's message, to the end; empty: no bag has it
-- slowest: latency_ns
-- brief: path, root_ns, latency_ns, age_from_stamp_ns, status, reason, is_ambiguous, take_id,
--     sink_ns, root_id
-- note: clocks
SELECT
    f.run_id, f.root_kind, f.root_id, f.root_ns, f.take_id, f.sink_ns, f.latency_ns, f.status,
    f.reason, f.is_ambiguous, p.is_cut, p.path, m.size_bytes,
    f.sink_ns - m.stamp_ns AS age_from_stamp_ns
FROM path_outcome AS f
JOIN named_path AS p ON f.path_id = p.path_id
LEFT JOIN (
    SELECT l.take_id, b.size_bytes, b.stamp_ns
    FROM main.link_transport AS l
    JOIN main.bag_message AS b ON l.publication_id = b.publication_id
) AS m ON f.take_id = m.take_id
WHERE CASE $case
    WHEN 'first' THEN f.is_first IS NOT false
    WHEN 'last' THEN f.is_last IS NOT false
    WHEN 'newest' THEN f.is_newest IS NOT false
    ELSE true
END
ORDER BY f.run_id, p.path, f.path_id, f.root_ns, f.root_kind, f.root_id, f.sink_ns, f.take_id
