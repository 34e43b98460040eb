-- description: What the latency of each flow of each path (main.end_to_end) consists of: parts that
--     follow each other and add up to it. A part is negative if the next one began before it ended:
--     clocks of two hosts are apart, a message was taken before the publishing call returned, or a
--     callback published for an input whose own callback was still running.
-- grain: one row per flow that reached the sink and part
-- param: runs, from_topic, to_topic, from_event, to_event, window_start_ns, window_end_ns,
--     flow_case, sink_take_id, max_depth, max_paths, most_flows, at_quantile, path_ids
-- column: run_id, path_id, flow_id, root_kind, root_id, take_id, latency_ns
-- column: hop BIGINT  Number of the message on the path that it belongs or leads to; one more than
--     the last for the callback at the end
-- column: position, part, from_ns, to_ns, duration_ns, callback_instance_id
-- column: publication_id BIGINT  Message that is published or under way
CREATE OR REPLACE MACRO main.end_to_end_part(
    runs, from_topic := NULL, to_topic := NULL, from_event := 'callback_start',
    to_event := 'callback_end', window_start_ns := NULL, window_end_ns := NULL,
    flow_case := 'first', sink_take_id := NULL, max_depth := 32, max_paths := 1000,
    most_flows := NULL, at_quantile := NULL, path_ids := NULL
) AS TABLE
WITH flow AS MATERIALIZED (
    FROM main.end_to_end_flow(
        runs, from_topic, to_topic, from_event, to_event, window_start_ns, window_end_ns,
        flow_case, sink_take_id := sink_take_id, max_depth := max_depth, max_paths := max_paths,
        most_flows := most_flows, at_quantile := at_quantile, path_ids := path_ids
    )
),
trail AS MATERIALIZED (
    FROM main.end_to_end_trail(
        'flow', runs, from_topic, to_topic, max_depth := max_depth, max_paths := max_paths
    )
)
FROM main.end_to_end_piece('flow', 'trail', runs)
