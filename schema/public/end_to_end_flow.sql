-- description: The flows that arrived (main.end_to_end), of one case, with a number each. The
--     first of three steps of main.end_to_end_part, which need less memory one by one: keep its
--     rows as a table, then those of main.end_to_end_trail, and ask main.end_to_end_piece.
-- grain: one row per flow that reached the sink
-- like: main.flow_chain, main.end_to_end
-- param: runs, from_topic, to_topic, from_event, to_event, window_start_ns, window_end_ns
-- param: flow_case VARCHAR = 'first'  Pairs of root and arrival: 'first', 'last', 'newest', or
--     'every_pair'
-- param: sink_take_id BIGINT = NULL  Only flows that end with this take
-- param: max_depth, max_paths
-- param: most_flows INTEGER = NULL  How many of these, the slowest first; NULL: all
-- param: at_quantile DOUBLE = NULL  In their place the flow with this quantile of the latency,
--     0 to 1
-- param: path_ids BIGINT[] = NULL  Only these paths; NULL: all
-- column: flow_id BIGINT  Number of the flow in this result
-- column: run_id
-- column: path_id BIGINT  Path, as main.flow_path numbers it for the same arguments
-- column: root_kind, root_id, root_ns
-- column: take_id BIGINT  Take at the end of the path
-- column: sink_event VARCHAR  Event that ended the flow, as in main.end_to_end
-- column: sink_ns
-- column: latency_ns BIGINT [ns]  From the start of the root to the end
-- column: is_ambiguous BOOLEAN  It passes a link that may be another one, as in main.end_to_end
CREATE OR REPLACE MACRO main.end_to_end_flow(
    runs, from_topic := NULL, to_topic := NULL, from_event := 'callback_start',
    to_event := 'callback_end', window_start_ns := NULL, window_end_ns := NULL,
    flow_case := 'first', sink_take_id := NULL, max_depth := 32, max_paths := 1000,
    most_flows := NULL, at_quantile := NULL, path_ids := NULL
) AS TABLE
WITH outcome AS NOT MATERIALIZED (
    FROM main.end_to_end(
        runs, from_topic, to_topic, from_event, to_event, window_start_ns, window_end_ns,
        max_depth := max_depth, max_paths := max_paths
    )
)
SELECT
    flow_id, run_id, path_id, root_kind, root_id, root_ns, take_id, sink_event, sink_ns, latency_ns,
    is_ambiguous
FROM main.chosen_flow(
    'outcome', flow_case, sink_take_id := sink_take_id, most_flows := most_flows,
    at_quantile := at_quantile, path_ids := path_ids
)
