-- description: The rows of `main.comparison`, and what `compare` can be asked with.
-- grain: one row per thing compared and statistic
-- param: run_a, run_b
-- param: a_window BIGINT[]  Begin and end of a time window of run A, epoch ns; NULL: all of it
-- param: b_window BIGINT[]  Begin and end of a time window of run B, epoch ns
-- param: what
-- param: from VARCHAR = NULL  Topics or nodes where paths start; globs
-- param: to VARCHAR = NULL  Topics or nodes where paths end; globs
-- param: case
-- param: skip_first DOUBLE = 0.0  Skip the first seconds of each run (warm-up)
-- param: confidence DOUBLE = 0.95  Confidence level of the intervals
-- param: at_least
-- param: resamples BIGINT = NULL  Number of resamples for the intervals: 1000, or
--     20 / (1 - confidence) if that is more, where none is given; 0 for no intervals
-- param: seed
-- param: internal BOOLEAN = false  Also compare what ROS does for itself
-- param: max_depth, max_paths
FROM main.comparison(
    $what, $run_a, $run_b, from_topic := $from, to_topic := $to, wanted_case := $case,
    skip_ns := round($skip_first * 1e9)::BIGINT, a_window := $a_window, b_window := $b_window,
    confidence := $confidence, at_least := $at_least, resamples := $resamples, seed := $seed,
    internal := $internal, max_depth := $max_depth, max_paths := $max_paths
)
