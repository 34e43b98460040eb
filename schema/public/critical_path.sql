-- description: What one flow had to wait for, moment by moment: its parts (main.end_to_end_part),
--     with waits replaced by what they waited for, as far as the trace shows. Before a callback:
--     what its executor was busy with, or what excludes the callback. In a callback: the services
--     that it called and waited for (main.waited_call). In a cache: the timer until it was due, or
--     the message that completed the set, from the callback that published it. Where the kernel was
--     traced, what a thread did is divided into its states. The pieces add up to the latency. A
--     negative part is one piece.
-- grain: one row per piece of the flow
-- param: runs, from_topic, to_topic, from_event, to_event, window_start_ns, window_end_ns,
--     sink_take_id, max_depth, max_paths
-- param: most_flows INTEGER = 1  How many of the longest flows
-- param: at_quantile
-- param: path_ids BIGINT[] = NULL  Only flows of these paths; NULL: all
-- param: flow_case
-- column: run_id, path_id, root_kind, root_id, take_id, latency_ns, flow_rank, hop, position
-- column: part VARCHAR  Part of the flow, as in main.end_to_end_part
-- column: activity, from_ns, to_ns, duration_ns, is_certain, callback_instance_id
-- column: publication_id BIGINT  Message that is published, under way or waited for
-- column: state, wakers, state_thread_id, priority, by_kind, by_thread_id, by_other_thread_id,
--     by_priority, request_id
CREATE OR REPLACE MACRO main.critical_path(
    runs, from_topic := NULL, to_topic := NULL, from_event := 'callback_start',
    to_event := 'callback_end', window_start_ns := NULL, window_end_ns := NULL,
    sink_take_id := NULL, max_depth := 32, max_paths := 1000, most_flows := 1, at_quantile := NULL,
    path_ids := NULL, flow_case := 'first'
) AS TABLE
WITH flow_part AS MATERIALIZED (
    FROM main.end_to_end_part(
        runs, from_topic, to_topic, from_event, to_event, window_start_ns, window_end_ns,
        flow_case, sink_take_id := sink_take_id, max_depth := max_depth, max_paths := max_paths,
        most_flows := most_flows, at_quantile := at_quantile, path_ids := path_ids
    )
)
FROM main.critical_piece('flow_part', runs)
