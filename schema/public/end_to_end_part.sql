-- description: What the latency of each flow of each path (main.end_to_end) consists of: parts that
--     follow each other and add up to it. A part is negative if the next one began before it ended:
--     clocks of two hosts are apart, a message was taken before the publishing call returned, or a
--     callback published for an input whose own callback was still running.
-- grain: one row per flow that reached the sink and part
-- like: main.end_to_end, main.end_to_end_flow
-- param: runs, from_topic, to_topic, from_event, to_event, window_start_ns, window_end_ns,
--     flow_case, sink_take_id, max_depth, max_paths, most_flows, at_quantile, path_ids
-- column: run_id, path_id, flow_id, root_kind, root_id
-- column: take_id BIGINT  Take at the end of the path
-- column: latency_ns BIGINT [ns]  From the start of the root to the end
-- column: hop BIGINT  Number of the message on the path that it belongs or leads to; one more than
--     the last for the callback at the end
-- column: position BIGINT  Order within the flow, from 1
-- column: part VARCHAR  'callback' (from its start, or from the take where none shows, to what it
--     publishes or calls), 'cache' (from the end of the callback to the callback instance that
--     publishes for it), 'intra', 'rclcpp', 'rcl', 'rmw', 'dds' (publishing, from this layer to the
--     next), 'publish' (publishing, layer not known), 'stored' (from the last layer until the
--     subscription existed, of a message that was published before), 'publish_to_take' (from there,
--     or from the last layer, to the take: writing the message, the network, an idle executor or a
--     busy one, see main.executor_wait), 'take_to_callback', 'request_to_take' (from the sending of
--     a request), 'service' (from the start of the service callback to what it publishes or calls,
--     or to the sending of the response), 'response_to_take' (from there on; what the client does
--     then is a 'callback' again, from the take on)
-- column: from_ns BIGINT [epoch ns]  Begin
-- column: to_ns BIGINT [epoch ns]  End
-- column: duration_ns BIGINT [ns]  to_ns - from_ns
-- column: callback_instance_id BIGINT  Callback instance that it is, or that it waits for
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
SELECT
    run_id, path_id, flow_id, root_kind, root_id, take_id, latency_ns, hop, position, part,
    from_ns, to_ns, duration_ns, callback_instance_id, publication_id
FROM main.end_to_end_piece('flow', 'trail', runs)
