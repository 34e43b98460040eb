-- title: Reaction time by path
-- description: How long it takes at most until something that happens shows at the end of a path.
--     What happens right after an input (the start of a flow) is seen by the next input at the
--     earliest, and shows in the first output that reflects that input or a later one. So the
--     reaction time of an interval between two inputs is from the earlier input to that output. If
--     an input is lost, the reaction waits for an output of a later one. The time window applies to
--     the later input.
-- grain: one row per path
-- reads: every_outcome, named_path
-- param: from, to, from_event, to_event, max_depth, max_paths
-- column: run_id
-- column: inputs BIGINT            Inputs in the time window
-- column: intervals BIGINT         Intervals between inputs that the times are computed from
-- column: unanswered BIGINT        Inputs that no output followed
-- column: loss_affected BIGINT     Intervals with a gap of a trace in the time of their input
-- column: ambiguous BIGINT         Intervals whose output passes a link that may be another one (a
--     candidate_count above 1)
-- column: min_ns BIGINT [ns]       Shortest reaction time
-- column: median_ns BIGINT [ns]    Median reaction time
-- column: mean_ns BIGINT [ns]      Mean reaction time
-- column: p95_ns, p99_ns
-- column: max_ns BIGINT [ns]       Maximum reaction time
-- column: event_mean_ns BIGINT [ns]  Mean over events at any moment of the intervals
-- column: sink_event, is_cut, path
-- brief: path, inputs, median_ns, p99_ns, max_ns, unanswered, ambiguous, loss_affected, p95_ns,
--     event_mean_ns, intervals, mean_ns, min_ns
-- note: clocks
CREATE OR REPLACE TEMP TABLE answered_input AS
WITH input AS (
    SELECT
        alike_id, root_kind, root_id,
        any_value(root_ns) AS root_ns,
        min(sink_ns) AS first_ns,
        any_value(sink_event) AS sink_event,
        bool_or(is_loss_affected) AS is_loss_affected,
        arg_min(is_ambiguous, sink_ns) AS is_ambiguous
    FROM every_outcome
    GROUP BY alike_id, root_kind, root_id
)
SELECT
    alike_id, root_ns, sink_event, is_loss_affected,
    lag(root_ns) OVER in_time AS previous_ns,
    min(first_ns) OVER from_here AS answer_ns,
    arg_min(is_ambiguous, first_ns) OVER from_here AS is_ambiguous
FROM input
WINDOW
    in_time AS (PARTITION BY alike_id ORDER BY root_ns, root_kind, root_id),
    from_here AS (
        PARTITION BY alike_id ORDER BY root_ns DESC, root_kind DESC, root_id DESC
        ROWS UNBOUNDED PRECEDING
    );

WITH windowed AS (
    SELECT
        alike_id, sink_event, is_loss_affected, is_ambiguous, answer_ns,
        root_ns - previous_ns AS interval_ns,
        answer_ns - previous_ns AS reaction_ns,
        answer_ns - root_ns AS delay_ns
    FROM answered_input
    WHERE root_ns >= $start_ns AND root_ns < $end_ns
),
measured AS (
    SELECT
        alike_id,
        count(*) AS inputs,
        count(reaction_ns) AS intervals,
        count(*) FILTER (WHERE answer_ns IS NULL) AS unanswered,
        count(*) FILTER (WHERE is_loss_affected AND reaction_ns IS NOT NULL) AS loss_affected,
        count(*) FILTER (WHERE is_ambiguous AND reaction_ns IS NOT NULL) AS ambiguous,
        any_value(sink_event) AS sink_event,
        main.spread(reaction_ns) AS reaction,
        round(
            sum(interval_ns * ((reaction_ns + delay_ns) / 2.0::DOUBLE))
            / nullif(sum(CASE WHEN reaction_ns IS NOT NULL THEN interval_ns END), 0)
        )::BIGINT AS event_mean_ns
    FROM windowed
    GROUP BY alike_id
)
SELECT
    p.run_id,
    coalesce(COLUMNS(['inputs', 'intervals', 'unanswered', 'loss_affected', 'ambiguous']), 0),
    unnest(m.reaction),
    m.event_mean_ns, m.sink_event, p.is_cut, p.path
FROM named_path AS p
LEFT JOIN measured AS m ON p.alike_id = m.alike_id
WHERE p.path_id = p.alike_id
ORDER BY p.run_id, p.path
