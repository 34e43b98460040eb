-- name: main.end_to_end_piece
-- kind: macro
-- description: The parts of flows: the last step of main.end_to_end_part.
-- grain: one row per flow and part
-- param: flows VARCHAR  Name of the rows of main.end_to_end_flow: a table, or a part of the query
-- param: trail VARCHAR  Likewise of main.end_to_end_trail
-- param: runs BIGINT[]  Runs that they are of
-- column: run_id BIGINT  Run
-- column: path_id BIGINT  Path, as main.flow_path numbers it for the same arguments
-- column: flow_id BIGINT  Number of the flow in this result
-- column: root_kind VARCHAR  'callback_instance', 'publication' or 'take'
-- column: root_id BIGINT  Identity of the root
-- column: take_id BIGINT  Take at the end of the path
-- column: latency_ns BIGINT [ns]  From the start of the root to the end
-- column: hop BIGINT  Number of the message on the path that it belongs or leads to; one more than
--     the last for the callback at the end
-- column: position BIGINT  Order within the flow, from 1
-- column: part VARCHAR  'callback' (from its start, or from the take where none shows, to what it
--     publishes or calls), 'cache' (from the end of the callback to the callback instance that
--     publishes for it),
--     'intra', 'rclcpp', 'rcl', 'rmw', 'dds' (publishing, from this layer to the next), 'publish'
--     (publishing, layer not known), 'stored' (from the last layer until the subscription existed,
--     of a message that was published before), 'publish_to_take' (from there, or from the last
--     layer, to the take: writing
--     the message, the network, an idle executor or a busy one, see main.executor_wait),
--     'take_to_callback', 'request_to_take' (from the sending of a request), 'service' (from the
--     start of the service callback to what it publishes or calls, or to the sending of the
--     response), 'response_to_take' (from there on; what the client does then is a 'callback'
--     again, from the take on)
-- column: from_ns BIGINT [epoch ns]  Begin
-- column: to_ns BIGINT [epoch ns]  End
-- column: duration_ns BIGINT [ns]  to_ns - from_ns
-- column: callback_instance_id BIGINT  Callback instance that it is, or that it waits for
-- column: publication_id BIGINT  Message that is published or under way
CREATE OR REPLACE MACRO main.end_to_end_piece(flows, trail, runs) AS TABLE
WITH every_callback_instance AS NOT MATERIALIZED (
    SELECT
        callback_instance_id, callback_id, take_id, start_ns, end_ns, NULL::BIGINT AS busy_min_ns,
        NULL::BIGINT AS busy_max_ns
    FROM main.callback_instance
)
SELECT
    run_id, path_id, flow_id, root_kind, root_id, take_id, latency_ns, hop, position, part,
    from_ns, to_ns, duration_ns, callback_instance_id, publication_id
FROM main.end_to_end_piece_explained(flows, trail, 'every_callback_instance', runs)
