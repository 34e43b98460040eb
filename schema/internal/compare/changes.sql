-- name: internal.changes
-- title: What changed
-- description: A comparison (`compared`: rows of `main.comparison`) with a row for each subject,
--     the greatest change of a median first.
-- grain: one row per path, callback or topic
-- param: only_different BOOLEAN  Leave out rows without a shown difference
-- column: change VARCHAR            'longer', 'shorter', 'both' (of different statistics),
--     'only in A', 'only in B', 'none shown' (the intervals contain 0), or why it is not known:
--     'too few values', 'too few independent values', 'too few resamples'
-- column: of VARCHAR                Statistics that are longer or shorter
-- column: a_median_ns BIGINT [ns]   Median in run A
-- column: b_median_ns BIGINT [ns]   Median in run B
-- column: median_percent DOUBLE [%]  Change of the median
-- column: a_p95_ns BIGINT [ns]      95 % of the values of run A are at most this
-- column: b_p95_ns BIGINT [ns]      95 % of the values of run B are at most this
-- column: p95_percent DOUBLE [%]    Change of that
-- column: separation VARCHAR        How well the values of the two runs can be told apart, by
--     Cliff's delta; not how large the change is
-- column: a_share DOUBLE            Share that arrived in run A
-- column: b_share DOUBLE            Share that arrived in run B
-- column: a_count BIGINT            Values of run A
-- column: b_count BIGINT            Values of run B
-- column: path VARCHAR              Path, callback or topic
-- brief: path, change, median_percent, a_median_ns, b_median_ns, of, a_p95_ns, b_p95_ns,
--     p95_percent, separation, a_count, b_count
WITH subject AS (
    SELECT
        subject,
        bool_or(verdict = 'B is longer') AS is_longer,
        bool_or(verdict = 'B is shorter') AS is_shorter,
        any_value(verdict) FILTER (WHERE verdict LIKE 'only in %') AS only_in,
        bool_or(verdict = 'no difference shown') AS is_estimated,
        any_value(verdict) FILTER (WHERE statistic = 'median') AS of_median,
        string_agg(statistic, ', ') FILTER (WHERE verdict IN ('B is longer', 'B is shorter'))
            AS statistics,
        any_value(a_ns) FILTER (WHERE statistic = 'median') AS a_median_ns,
        any_value(b_ns) FILTER (WHERE statistic = 'median') AS b_median_ns,
        any_value(change_percent) FILTER (WHERE statistic = 'median') AS median_percent,
        any_value(a_ns) FILTER (WHERE statistic = 'p95') AS a_p95_ns,
        any_value(b_ns) FILTER (WHERE statistic = 'p95') AS b_p95_ns,
        any_value(change_percent) FILTER (WHERE statistic = 'p95') AS p95_percent,
        any_value(separation) AS separation,
        any_value(a_share) AS a_share,
        any_value(b_share) AS b_share,
        any_value(a_count) AS a_count,
        any_value(b_count) AS b_count
    FROM compared
    GROUP BY subject
)
SELECT
    CASE
        WHEN is_longer AND is_shorter THEN 'both'
        WHEN is_longer THEN 'longer'
        WHEN is_shorter THEN 'shorter'
        WHEN only_in IS NOT NULL THEN only_in
        WHEN is_estimated THEN 'none shown'
        ELSE of_median
    END AS change,
    statistics AS of,
    a_median_ns, b_median_ns, median_percent, a_p95_ns, b_p95_ns, p95_percent, separation, a_share,
    b_share, a_count, b_count, subject AS path
FROM subject
WHERE NOT $only_different OR is_longer OR is_shorter OR only_in IS NOT NULL
ORDER BY abs(b_median_ns - a_median_ns) DESC NULLS FIRST, subject
