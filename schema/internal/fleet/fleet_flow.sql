-- title: Flows of every path, one by one
-- description: Rows of main.end_to_end with its defaults (from the start of a callback to the end
--     of one), each with its path. The query e2e-latency summarises these rows for a run. The rows
--     of several runs together give its answer for all of them.
-- grain: one row per path, root and arrival; one per path and root that did not arrive
-- column: run_id
-- column: path VARCHAR  Nodes and topics of the path
-- column: path_id BIGINT  Number of the path in the run: several paths may have one text
-- column: root_kind
-- column: root_id BIGINT  Identity of the root in the run
-- column: root_ns
-- column: take_id BIGINT  Take at the end of the path; NULL: not reached
-- column: sink_event VARCHAR  Event that ended the flow: 'callback_end', or 'take' where the sink
--     never shows a callback
-- column: sink_ns
-- column: latency_ns BIGINT [ns]  From the start of the root to the end; NULL: not reached, or a
--     message on the way was stored until its subscription existed
-- column: status
-- column: reason VARCHAR  Why it did not arrive
-- column: is_first, is_last, is_newest
-- column: is_loss_affected BOOLEAN  A gap of a trace overlaps its time
-- column: is_ambiguous
WITH path_chain AS MATERIALIZED (FROM main.flow_chain($runs)),
named_path AS MATERIALIZED (
    SELECT path_id, alike_id, path
    FROM main.flow_path($runs, only_paths := true, chains := 'path_chain')
)
SELECT
    e.run_id, p.path, e.path_id, e.root_kind, e.root_id, e.root_ns, e.take_id, e.sink_event,
    e.sink_ns, e.latency_ns, e.status, e.reason, e.is_first, e.is_last, e.is_newest,
    e.is_loss_affected, e.is_ambiguous
FROM main.end_to_end($runs, chains := 'path_chain', paths := 'named_path') AS e
JOIN named_path AS p ON e.path_id = p.path_id
ORDER BY
    e.run_id, p.path, e.path_id, e.root_ns, e.root_kind, e.root_id, e.sink_ns, e.take_id
