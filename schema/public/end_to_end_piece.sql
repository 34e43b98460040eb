-- description: The parts of flows: the last step of main.end_to_end_part.
-- grain: one row per flow and part
-- param: flows, trail, runs
-- column: run_id, path_id, flow_id, root_kind, root_id, take_id, latency_ns
-- column: hop BIGINT  Number of the message on the path that it belongs or leads to; one more than
--     the last for the callback at the end
-- column: position, part, from_ns, to_ns, duration_ns, callback_instance_id
-- column: publication_id BIGINT  Message that is published or under way
CREATE OR REPLACE MACRO main.end_to_end_piece(flows, trail, runs) AS TABLE
WITH every_callback_instance AS NOT MATERIALIZED (
    SELECT
        callback_instance_id, callback_id, take_id, start_ns, end_ns,
        NULL::BIGINT AS busy_min_ns,
        NULL::BIGINT AS busy_max_ns
    FROM main.callback_instance
)
SELECT
    run_id, path_id, flow_id, root_kind, root_id, take_id, latency_ns, hop, position, part,
    from_ns, to_ns, duration_ns, callback_instance_id, publication_id
FROM main.end_to_end_piece_explained(flows, trail, 'every_callback_instance', runs)
