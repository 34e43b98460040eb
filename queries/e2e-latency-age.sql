-- title: Data age by path
-- description: How old the data behind the output of a path are. The age of an output (the end of
--     the path) is that of the newest input (start of a flow) that it reflects. Data stay in use
--     until the next output. Their age right before that is the highest that they reach: the peak
--     age. The time window applies to outputs.
-- grain: one row per path
-- reads: path_chain, named_path
-- param: from, to, from_event, to_event, max_depth, max_paths
-- column: run_id
-- column: outputs BIGINT           Outputs in the time window
-- column: loss_affected BIGINT     Outputs with a gap of a trace in the time since their input
-- column: ambiguous BIGINT         Outputs that pass a link that may be another one (a
--     candidate_count above 1)
-- column: min_ns BIGINT [ns]       Lowest age of an output
-- column: median_ns BIGINT [ns]    Median age of outputs
-- column: mean_ns BIGINT [ns]      Mean age of outputs
-- column: p95_ns, p99_ns
-- column: max_ns BIGINT [ns]       Highest age of an output
-- column: peak_median_ns BIGINT [ns]  Median peak age
-- column: peak_p95_ns BIGINT [ns]     95 % of the peak ages are at most this
-- column: peak_max_ns BIGINT [ns]     Maximum data age: the highest peak age
-- column: time_mean_ns BIGINT [ns]    Mean age over time, from the first output to the last
-- column: sink_event, is_cut, path
-- brief: path, outputs, median_ns, p99_ns, max_ns, peak_max_ns, ambiguous, loss_affected, p95_ns,
--     peak_median_ns, peak_p95_ns, mean_ns
-- note: clocks

-- Of the whole recording: the window is one of outputs, or of later inputs.
CREATE OR REPLACE TEMP TABLE every_outcome AS
FROM main.end_to_end(
    $runs, $from, $to, $from_event, $to_event, chains := 'path_chain',
    paths := 'named_path', has_calls := $has_calls, has_gaps := $has_gaps,
    has_states := $has_states
);

WITH output AS (
    SELECT
        alike_id, sink_event, sink_ns,
        sink_ns - root_ns AS age_ns,
        is_loss_affected, is_ambiguous,
        lead(sink_ns) OVER (PARTITION BY alike_id ORDER BY sink_ns, take_id) - root_ns AS peak_ns
    FROM every_outcome
    WHERE status = 'reached' AND is_newest
),
measured AS (
    SELECT
        alike_id,
        count(*) AS outputs,
        count(*) FILTER (WHERE is_loss_affected) AS loss_affected,
        count(*) FILTER (WHERE is_ambiguous) AS ambiguous,
        any_value(sink_event) AS sink_event,
        main.spread(age_ns) AS age,
        quantile_disc(peak_ns, [0.5, 0.95]) AS peaks,
        max(peak_ns) AS peak_max_ns,
        round(
            sum((peak_ns - age_ns) * ((peak_ns + age_ns) / 2.0::DOUBLE))
            / nullif(sum(peak_ns - age_ns), 0)
        )::BIGINT AS time_mean_ns
    FROM output
    WHERE sink_ns >= $start_ns AND sink_ns < $end_ns
    GROUP BY alike_id
)
SELECT
    p.run_id,
    coalesce(COLUMNS(['outputs', 'loss_affected', 'ambiguous']), 0),
    unnest(m.age),
    m.peaks[1] AS peak_median_ns,
    m.peaks[2] AS peak_p95_ns,
    m.peak_max_ns, m.time_mean_ns, m.sink_event, p.is_cut, p.path
FROM named_path AS p
LEFT JOIN measured AS m ON p.alike_id = m.alike_id
WHERE p.path_id = p.alike_id
ORDER BY p.run_id, p.path
