-- title: Functions that the CPU time of callbacks goes to
-- description: Which functions ran inside each callback, as samples of perf tell
--     (docs/functions.md, record --profile), and outside of callbacks, such as in the executor and
--     the middleware. With a path, or places on it, only the callbacks on the way of flows count:
--     their instances whole, also what they did behind their publication. Rows of one callback
--     overlap: a function has the time of what it calls, too. Few samples say little: of 100, a
--     share is right within 10 points.
-- grain: one row per callback, or process outside of callbacks, and function
-- param: from, to, via, without
-- param: slowest BIGINT {1..} = NULL  Only so many flows, the slowest; where none are chosen, so
--     many instances of each callback, the longest
-- column: run_id
-- column: node VARCHAR [node]      Node of the callback, or the process in brackets
-- column: callback VARCHAR [callback]  What triggers it, or 'outside of callbacks'
-- column: function VARCHAR         Function; '[unknown]': its file has no symbol for it
-- column: self_share DOUBLE [share]  Part of the samples of the callback in which it ran
-- column: total_share
-- column: self_ns BIGINT [ns]      CPU time in it; empty: perf counted cycles
-- column: total_ns BIGINT [ns]     CPU time in it, and in what it called
-- column: per_call_ns BIGINT [ns]  total_ns for each instance of the callback
-- column: calls BIGINT             Instances of the callback; empty outside
-- column: self_samples, samples
-- column: file VARCHAR             Library or program that has it, of Python the source file
-- column: callback_id BIGINT       Identity of the callback, of the first of several
-- column: is_internal
-- brief: callback, function, self_share, total_share, per_call_ns, node, self_ns, samples, file
-- note: samples
CREATE OR REPLACE TEMP TABLE function_chain AS
FROM main.flow_chain($runs, $from, $to);

CREATE OR REPLACE TEMP TABLE function_outcome AS
FROM main.end_to_end(
    $runs, $from, $to, 'callback_start', 'callback_end', $start_ns, $end_ns,
    chains := 'function_chain'
)
WHERE coalesce($from, $to, $via, $without) IS NOT NULL
    AND path_id IN (
        SELECT path_id
        FROM main.flow_path($runs, only_paths := true, chains := 'function_chain')
        WHERE main.path_visits(path, $via, $without)
    );

CREATE OR REPLACE TEMP TABLE function_flow AS
SELECT
    *,
    row_number() OVER (ORDER BY latency_ns DESC, flow_id) AS place
FROM main.chosen_flow('function_outcome', most_flows := $slowest);

CREATE OR REPLACE TEMP TABLE function_trail AS
FROM main.end_to_end_trail('function_flow', $runs, chains := 'function_chain');

-- The place counts from the slowest flow that it is on the way of, or the longest instance.
CREATE OR REPLACE TEMP TABLE function_instance AS
SELECT
    p.callback_instance_id,
    min(f.place) AS place
FROM main.end_to_end_piece('function_flow', 'function_trail', $runs) AS p
JOIN function_flow AS f ON p.flow_id = f.flow_id
WHERE p.part IN ('callback', 'service')
GROUP BY p.callback_instance_id
UNION ALL
SELECT
    i.callback_instance_id,
    row_number() OVER (
        PARTITION BY k.alike_id
        ORDER BY i.end_ns - i.start_ns DESC NULLS LAST, i.start_ns, i.callback_instance_id
    ) AS place
FROM main.callback_instance AS i
JOIN main.callback_alike AS k ON i.callback_id = k.callback_id
WHERE coalesce($from, $to, $via, $without) IS NULL AND list_contains($runs, i.run_id)
    AND i.start_ns >= $start_ns AND i.start_ns < $end_ns
QUALIFY $slowest IS NULL OR place <= $slowest;

WITH instance AS (
    SELECT
        i.callback_instance_id,
        k.alike_id AS callback_id
    FROM function_instance AS f
    JOIN main.callback_instance AS i ON f.callback_instance_id = i.callback_instance_id
    JOIN main.callback_alike AS k ON i.callback_id = k.callback_id
),
counted AS (
    SELECT
        callback_id AS group_id,
        count(*) AS calls
    FROM instance
    GROUP BY callback_id
),
-- Outside of callbacks, a group is a process: the negative of its id.
sample AS (
    SELECT
        coalesce(i.callback_id, -s.process_id) AS group_id,
        s.stack_id, s.cpu_ns
    FROM main.stack_sample AS s
    LEFT JOIN instance AS i ON s.callback_instance_id = i.callback_instance_id
    WHERE list_contains($runs, s.run_id)
        AND CASE
            WHEN s.callback_instance_id IS NOT NULL THEN i.callback_id IS NOT NULL
            ELSE coalesce($from, $to, $via, $without) IS NULL AND $slowest IS NULL
                AND s.at_ns >= $start_ns AND s.at_ns < $end_ns
        END
),
found AS (FROM main.function_time('sample')),
-- Those with most samples come first.
placed AS (
    SELECT
        group_id,
        row_number() OVER (ORDER BY sum(self_samples) DESC, group_id) AS place
    FROM found
    GROUP BY group_id
)
SELECT
    f.run_id,
    coalesce(l.node, main.node_label(NULL, p.name, p.pid)) AS node,
    coalesce(l.label, 'outside of callbacks') AS callback,
    f.function, t.self_share, t.total_share, t.self_ns, t.total_ns,
    t.total_ns // c.calls AS per_call_ns,
    c.calls, t.self_samples, t.samples, f.file,
    l.callback_id AS callback_id,
    coalesce(l.is_internal, false) AS is_internal
FROM found AS t
JOIN placed AS g ON t.group_id = g.group_id
JOIN main.stack_frame AS f ON t.stack_frame_id = f.stack_frame_id
LEFT JOIN main.callback_label AS l ON t.group_id = l.callback_id
LEFT JOIN main.process AS p ON t.group_id = -p.process_id
LEFT JOIN counted AS c ON t.group_id = c.group_id
ORDER BY f.run_id, g.place, t.self_samples DESC, t.samples DESC, f.function, f.file
