-- name: functions-flows
-- title: Functions that the CPU time of flows goes to
-- description: Which functions ran inside the callbacks on the way of flows, as samples of perf
--     tell (docs/functions.md). All instances on the way count whole, also what they did behind
--     their publication.
-- grain: one row per callback on the way of a flow, and function
-- param: from VARCHAR = NULL  Topics or nodes where flows start: globs, with commas between
-- param: to VARCHAR = NULL  Topics or nodes where flows end, likewise
-- param: slowest BIGINT {1..} = NULL  Only so many flows, the slowest
-- param: case VARCHAR {first|last|newest|every_pair} = 'first'  Arrivals that count: the
--     first or last of each root, that of the newest root, or all
-- param: from_event VARCHAR {callback_start|publish} = 'callback_start'  Event that starts
--     the clock
-- param: to_event VARCHAR {take|callback_start|callback_end} = 'callback_end'  Event that
--     stops it
-- param: max_depth BIGINT {1..} = 32     Longest path
-- param: max_paths BIGINT {1..} = 1000   Most paths, shortest first, and chains of a length
-- column: run_id BIGINT            Run
-- column: node VARCHAR [node]      Node of the callback, or the process in brackets
-- column: callback VARCHAR [callback]  What triggers it
-- column: function VARCHAR         Function; '[unknown]': its file has no symbol for it
-- column: self_share DOUBLE [share]  Part of the samples of the callback in which it ran
-- column: total_share DOUBLE [share]  Part in which it ran, or what it called
-- column: self_ns BIGINT [ns]      CPU time in it; empty: perf counted cycles
-- column: total_ns BIGINT [ns]     CPU time in it, and in what it called
-- column: per_call_ns BIGINT [ns]  total_ns for each instance of the callback
-- column: calls BIGINT             Instances of the callback on the way of these flows
-- column: self_samples BIGINT      Samples in which it ran
-- column: samples BIGINT           Samples in which it ran, or what it called
-- column: file VARCHAR             Library or program that has it, of Python the source file
-- column: callback_id BIGINT       Identity of the callback, of the first of several
-- column: is_internal BOOLEAN      Infrastructure of ROS
-- brief: callback, function, self_share, total_share, per_call_ns, node, self_ns, samples, file
-- note: clocks
CREATE OR REPLACE TEMP TABLE path_outcome AS
SELECT
    run_id, path_id, root_kind, root_id, root_ns, take_id, sink_event, sink_ns, latency_ns, status,
    reason, is_first, is_last, is_newest, is_loss_affected, is_ambiguous
FROM main.end_to_end(
    $runs, $from, $to, $from_event, $to_event, $start_ns, $end_ns,
    max_depth := $max_depth, max_paths := $max_paths
);

CREATE OR REPLACE TEMP TABLE function_flow AS
SELECT
    flow_id, run_id, path_id, root_kind, root_id, root_ns, take_id, sink_event, sink_ns, latency_ns,
    is_ambiguous
FROM main.chosen_flow('path_outcome', $case, most_flows := $slowest);

CREATE OR REPLACE TEMP TABLE function_trail AS
SELECT flow_id, hop, take_id, publication_id, previous_take_id, next_take_id
FROM main.end_to_end_trail(
    'function_flow', $runs, $from, $to, max_depth := $max_depth, max_paths := $max_paths
);

CREATE OR REPLACE TEMP TABLE function_instance AS
SELECT DISTINCT callback_instance_id
FROM main.end_to_end_piece('function_flow', 'function_trail', $runs)
WHERE part IN ('callback', 'service');

WITH instance AS (
    SELECT i.callback_instance_id, k.alike_id AS callback_id
    FROM function_instance AS f
    JOIN main.callback_instance AS i ON f.callback_instance_id = i.callback_instance_id
    JOIN main.callback_alike AS k ON i.callback_id = k.callback_id
),
counted AS (
    SELECT callback_id AS group_id, count(*) AS calls FROM instance GROUP BY callback_id
),
sample AS (
    SELECT i.callback_id AS group_id, s.stack_id, s.cpu_ns
    FROM main.stack_sample AS s
    JOIN instance AS i ON s.callback_instance_id = i.callback_instance_id
),
found AS (SELECT * FROM main.function_time('sample')),
-- Those with most samples come first.
placed AS (
    SELECT group_id, row_number() OVER (ORDER BY sum(self_samples) DESC, group_id) AS place
    FROM found
    GROUP BY group_id
)
SELECT
    f.run_id,
    l.node AS node,
    l.label AS callback,
    f.function,
    t.self_share,
    t.total_share,
    t.self_ns,
    t.total_ns,
    t.total_ns // c.calls AS per_call_ns,
    c.calls,
    t.self_samples,
    t.samples,
    f.file,
    l.callback_id AS callback_id,
    l.is_internal AS is_internal
FROM found AS t
JOIN placed AS g ON t.group_id = g.group_id
JOIN main.stack_frame AS f ON t.stack_frame_id = f.stack_frame_id
JOIN main.callback_label AS l ON t.group_id = l.callback_id
JOIN counted AS c ON t.group_id = c.group_id
ORDER BY f.run_id, g.place, t.self_samples DESC, t.samples DESC, f.function, f.file
