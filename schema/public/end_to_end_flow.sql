-- description: The flows that arrived (main.end_to_end), of one case, with a number each. The
--     first of three steps of main.end_to_end_part, which need less memory one by one: keep its
--     rows as a table, then those of main.end_to_end_trail, and ask main.end_to_end_piece.
-- grain: one row per flow that reached the sink
-- param: runs, from_topic, to_topic, from_event, to_event, window_start_ns, window_end_ns,
--     flow_case, sink_take_id, max_depth, max_paths, most_flows, at_quantile, path_ids
-- column: flow_id, run_id, path_id, root_kind, root_id, root_ns, take_id, sink_event, sink_ns,
--     latency_ns, is_ambiguous
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
FROM main.chosen_flow(
    'outcome', flow_case, sink_take_id := sink_take_id, most_flows := most_flows,
    at_quantile := at_quantile, path_ids := path_ids
)
