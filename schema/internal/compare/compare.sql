-- description: The rows of `main.comparison`, and what `compare` can be asked with.
-- grain: one row per thing compared and statistic
-- param: run_a BIGINT  Run that the other one is compared with
-- param: run_b BIGINT  The other one
-- param: a_window BIGINT[]  Begin and end of a time window of run A, epoch ns; NULL: all of it
-- param: b_window BIGINT[]  The same for run B
-- param: what VARCHAR {paths|ends|callbacks|topics} = 'paths'  End-to-end latency of paths, or
--     between two topics by any path, duration of callbacks, or time from publication to take of
--     topics
-- param: from VARCHAR = NULL  Topics or nodes where paths start; globs
-- param: to VARCHAR = NULL  Topics or nodes where paths end; globs
-- param: case VARCHAR {first|last|newest|every_pair} = 'first'  First or last arrival of each root,
--     newest root of each arrival, or all pairs
-- param: skip_first DOUBLE = 0.0  Skip the first seconds of each run (warm-up)
-- param: confidence DOUBLE = 0.95  Confidence level of the intervals
-- param: at_least DOUBLE  Smallest difference that counts as one, as a share of A
-- param: resamples BIGINT = NULL  Number of resamples for the intervals: 1000, or
--     20 / (1 - confidence) if that is more, where none is given; 0 for no intervals
-- param: seed BIGINT = 0  Random seed
-- param: internal BOOLEAN = false  Also compare what ROS does for itself
-- param: max_depth INTEGER {1..} = 32  Longest path, in topics
-- param: max_paths INTEGER {1..} = 1000  Maximum number of paths, shortest first; also the limit on
--     chains of each length
FROM main.comparison(
    $what, $run_a, $run_b, from_topic := $from, to_topic := $to, wanted_case := $case,
    skip_ns := round($skip_first * 1e9)::BIGINT, a_window := $a_window, b_window := $b_window,
    confidence := $confidence, at_least := $at_least, resamples := $resamples, seed := $seed,
    internal := $internal, max_depth := $max_depth, max_paths := $max_paths
)
