-- title: End-to-end latency by path
-- description: How long it took from the start of a flow (the callback of the timer that published,
--     or the publication itself) to its end (the end of the callback at the end of the path), for
--     every path of the computation graph. Every root is counted once: reached the end,
--     superseded by a newer input, dropped (a queue was full), lost on the way, no output (a node
--     did not publish), not connected, cut by the recording (too close to its start or end to
--     know), or unknown. Several subscriptions or publishers of a node, and its lives, one after
--     the other, are one path.
-- grain: one row per path
-- variant: measure VARCHAR {latency|age|reaction|response} = 'latency'  From start to end of flows,
--     age of the data behind an output, time until an event shows, or response times of CARET
-- variant: by VARCHAR {path|ends} = 'path'  A row for each path, or for two topics
-- param: from, to, from_event, to_event, case, max_depth, max_paths
-- column: run_id
-- column: roots BIGINT             Flows that began in the time window
-- column: reached BIGINT           Roots that reached the end of the path
-- column: superseded BIGINT        Roots replaced by a newer input before they were used
-- column: dropped BIGINT           Roots that ended in a full queue: newer messages took their
--     place
-- column: lost BIGINT              Roots that were lost on the way
-- column: no_output BIGINT         Roots that ended at a node that did not publish
-- column: not_connected BIGINT     Roots that ended before or after a publisher and a subscription
--     were connected
-- column: unknown BIGINT           Roots that end where the trace does not show
-- column: cut_by_recording BIGINT  Roots too close to the start or end of the recording to know
-- column: loss_affected BIGINT     Roots with a gap of a trace in their time: their status may be
--     wrong
-- column: ambiguous BIGINT         Pairs that pass a link that may be another one (a
--     candidate_count above 1), so that the pair may be none
-- column: pairs BIGINT             Pairs of root and arrival that the latencies are computed from
-- column: stored BIGINT            Pairs left out of the latencies: a message on the way was
--     published before its subscription existed, and stored until then
-- column: looped BIGINT            Later messages at the end of the path that descend from an
--     arrival there through a loop. They are not pairs, since a path visits no subscription twice
-- column: min_ns
-- column: median_ns BIGINT [ns]    Median latency
-- column: mean_ns BIGINT [ns]      Mean latency
-- column: p95_ns, p99_ns
-- column: max_ns BIGINT [ns]       Longest latency
-- column: max_root_ns BIGINT [epoch ns]  When the flow with the longest latency began
-- column: max_take_id BIGINT       Take at its end: msgflow flow --take
-- column: sink_event, is_cut
-- column: reasons MAP(VARCHAR, BIGINT)  Why roots did not reach the end of the path, and how many
-- column: path
-- brief: path, median_ns, p99_ns, max_ns, reached, lost, ambiguous, loss_affected, dropped,
--     roots (even 0), p95_ns, superseded, no_output, reasons, not_connected, unknown,
--     cut_by_recording, mean_ns, min_ns, pairs, stored
-- note: clocks
CREATE OR REPLACE TEMP TABLE path_chain AS
FROM main.flow_chain($runs, $from, $to, max_depth := $max_depth, max_paths := $max_paths);

CREATE OR REPLACE TEMP TABLE named_path AS
SELECT
    run_id, path_id, alike_id, subscription_id, is_path,
    bool_or(is_cut) OVER (PARTITION BY alike_id) AS is_cut,
    path, topics, publishers, subscriptions
FROM main.flow_path($runs, only_paths := true, chains := 'path_chain');

CREATE OR REPLACE TEMP TABLE path_outcome AS
FROM main.end_to_end(
    $runs, $from, $to, $from_event, $to_event, $start_ns, $end_ns, chains := 'path_chain',
    paths := 'named_path', has_calls := $has_calls, has_gaps := $has_gaps,
    has_states := $has_states
);

-- Only where the end of a path goes on can anything come back to it.
-- when: named_path WHERE subscription_id IN (FROM main.continued_subscription($runs))
-- columns: path_id BIGINT, number BIGINT
CREATE OR REPLACE TEMP TABLE looped_path AS
SELECT
    path_id,
    count(*) AS number
FROM main.looped_arrival(
    $runs,
    (
        SELECT list([path_id, take_id])
        FROM (
            SELECT DISTINCT path_id, take_id
            FROM path_outcome
            WHERE take_id IS NOT NULL AND path_id IN (
                SELECT path_id
                FROM named_path
                WHERE subscription_id IN (FROM main.continued_subscription($runs))
            )
        )
    )
)
GROUP BY path_id;

WITH flow AS (
    SELECT
        *,
        CASE $case
            WHEN 'first' THEN is_first
            WHEN 'last' THEN is_last
            WHEN 'newest' THEN is_newest
            ELSE true
        END AS is_counted
    FROM path_outcome
),
-- What became of a root is the same in each of its rows, but for gaps in its time.
completeness AS (
    SELECT
        alike_id,
        count(*) FILTER (is_first IS NOT false) AS roots,
        histogram(status) FILTER (is_first IS NOT false)::MAP(VARCHAR, BIGINT) AS number,
        main.word_counts(CASE WHEN status <> 'reached' THEN reason END) AS reasons,
        count(DISTINCT (root_kind, root_id)) FILTER (is_loss_affected) AS loss_affected
    FROM flow
    GROUP BY alike_id
),
latency AS (
    SELECT
        alike_id,
        count(*) FILTER (WHERE is_ambiguous) AS ambiguous,
        count(latency_ns) AS pairs,
        count(*) - count(latency_ns) AS stored,
        any_value(sink_event) AS sink_event,
        main.spread(latency_ns) AS latency,
        -- Of equally long ones the first, and of its arrivals the first.
        max(struct_pack(latency_ns, before_ns := -root_ns, before_take := -take_id))
            FILTER (WHERE latency_ns IS NOT NULL) AS longest
    FROM flow
    WHERE status = 'reached' AND is_counted
    GROUP BY alike_id
),
looped AS (
    SELECT
        p.alike_id,
        sum(o.number)::BIGINT AS number
    FROM looped_path AS o
    JOIN named_path AS p ON o.path_id = p.path_id
    GROUP BY p.alike_id
)
SELECT
    p.run_id,
    coalesce(c.roots, 0) AS roots,
    coalesce(c.number['reached'], 0) AS reached,
    coalesce(c.number['superseded'], 0) AS superseded,
    coalesce(c.number['dropped'], 0) AS dropped,
    coalesce(c.number['lost'], 0) AS lost,
    coalesce(c.number['no_output'], 0) AS no_output,
    coalesce(c.number['not_connected'], 0) AS not_connected,
    coalesce(c.number['unknown'], 0) AS unknown,
    coalesce(c.number['cut_by_recording'], 0) AS cut_by_recording,
    coalesce(COLUMNS(['loss_affected', 'ambiguous', 'pairs', 'stored']), 0),
    coalesce(o.number, 0) AS looped,
    unnest(l.latency),
    -l.longest.before_ns AS max_root_ns,
    -l.longest.before_take AS max_take_id,
    l.sink_event, p.is_cut, c.reasons, p.path
FROM named_path AS p
LEFT JOIN completeness AS c ON p.alike_id = c.alike_id
LEFT JOIN latency AS l ON p.alike_id = l.alike_id
LEFT JOIN looped AS o ON p.alike_id = o.alike_id
WHERE p.path_id = p.alike_id
ORDER BY p.run_id, p.path
