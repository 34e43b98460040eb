-- name: internal.flow_steps
-- title: Steps of a flow
-- description: The steps of `main.flow_step`, with how long the executor was busy before the
--     callbacks of takes and requests.
-- grain: one row per vertex and link that leads to it
-- param: kind VARCHAR  'publication', 'take', 'callback_instance', 'request' or 'response'
-- param: id BIGINT  Its identity
-- param: direction VARCHAR {forward|backward|both} = 'both'  Follow what it caused, what caused it,
--     or both
-- param: depth INTEGER {0..} = 32  Maximum number of messages in a row, each way
-- param: limit INTEGER {1..} = 1000  Maximum number of publications, takes, callback instances,
--     requests and responses
-- param: internal BOOLEAN = false  Follow effects on topics and services of ROS itself too
-- param: run_id BIGINT  Its run
SELECT s.run_id, s.depth, s.from_kind, s.from_id, s.link_kind, s.wait_ns, s.candidate_count,
    s.is_loss_affected, s.kind, s.id, s.start_ns, s.end_ns, s.node, s.label, s.topic_name,
    s.symbol, s.thread, s.host, s.missing, s.reason, s.cut_count, s.internal_count,
    w.busy_min_ns, w.busy_max_ns
FROM main.flow_step(
    $kind, $id,
    direction := $direction,
    -- A message is three steps; no flow within the limit has more than it has vertices.
    max_depth := least($depth::BIGINT * 3, 10000)::INTEGER,
    max_vertices := $limit,
    internal := $internal
) AS s
LEFT JOIN (
    SELECT callback_instance_id, busy_min_ns, busy_max_ns
    FROM main.executor_wait
    WHERE run_id = $run_id AND since IN ('publication', 'request')
) AS w ON s.kind = 'callback_instance' AND s.id = w.callback_instance_id
ORDER BY abs(s.depth), s.depth, s.start_ns, s.kind, s.id, s.from_kind, s.from_id, s.link_kind
