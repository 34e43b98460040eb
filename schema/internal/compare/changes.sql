-- title: What changed
-- description: A comparison (`compared`: rows of `main.comparison`) with a row for each subject,
--     those that differ first, then the greatest change of a median.
-- grain: one row per path, callback or topic
-- reads: compared
-- column: change VARCHAR            'longer', 'shorter', 'both' (of different statistics), 'only in
--     A', 'only in B', 'about equal' (less than matters), 'none shown' (the intervals contain 0),
--     or why it is not known: 'too few values', 'too few independent values', 'too few resamples'
-- column: of VARCHAR                Statistics of which that is said
-- column: a_median_ns BIGINT [ns]   Median in run A
-- column: b_median_ns BIGINT [ns]   Median in run B
-- column: median_percent DOUBLE [%] Change of the median
-- column: median_verdict VARCHAR    Whether the median differs: a verdict of `main.comparison`
-- column: a_p95_ns BIGINT [ns]      95 % of the values of run A are at most this
-- column: b_p95_ns BIGINT [ns]      95 % of the values of run B are at most this
-- column: p95_percent DOUBLE [%]    Change of that
-- column: p95_verdict VARCHAR       Whether that differs
-- column: a_max_ns BIGINT [ns]      Longest value in run A
-- column: b_max_ns BIGINT [ns]      Longest value in run B
-- column: max_percent DOUBLE [%]    Change of that
-- column: max_verdict VARCHAR       'not estimated': one value of either run says nothing of chance
-- column: a_share DOUBLE            Share that arrived in run A
-- column: b_share DOUBLE            Share that arrived in run B
-- column: a_count BIGINT            Values of run A
-- column: b_count BIGINT            Values of run B
-- column: a_ambiguous BIGINT        Of these, values that pass a link that may be another one
-- column: b_ambiguous BIGINT        The same of run B
-- column: path VARCHAR              Path, callback or topic
-- brief: path, change, of, a_median_ns, b_median_ns, median_percent, a_p95_ns, b_p95_ns,
--     p95_percent, max_percent, a_ambiguous, b_ambiguous, a_count, b_count, a_max_ns, b_max_ns,
--     median_verdict, p95_verdict, max_verdict
WITH subject AS (
    SELECT
        subject,
        bool_or(verdict = 'B is longer') AS is_longer,
        bool_or(verdict = 'B is shorter') AS is_shorter,
        any_value(verdict) FILTER (WHERE verdict LIKE 'only in %') AS only_in,
        any_value(a_share) AS a_share,
        any_value(b_share) AS b_share,
        any_value(a_count) AS a_count,
        any_value(b_count) AS b_count,
        any_value(a_ambiguous) AS a_ambiguous,
        any_value(b_ambiguous) AS b_ambiguous,
        string_agg(statistic, ', ') FILTER (WHERE verdict IN ('B is longer', 'B is shorter'))
            AS differing,
        string_agg(statistic, ', ') FILTER (WHERE verdict = 'about equal') AS alike,
        string_agg(statistic, ', ') FILTER (WHERE verdict = 'no difference shown') AS estimated,
        any_value({a: a_ns, b: b_ns, percent: change_percent, verdict: verdict})
            FILTER (WHERE statistic = 'median') AS median,
        any_value({a: a_ns, b: b_ns, percent: change_percent, verdict: verdict})
            FILTER (WHERE statistic = 'p95') AS p95,
        any_value({a: a_ns, b: b_ns, percent: change_percent, verdict: verdict})
            FILTER (WHERE statistic = 'max') AS longest
    FROM compared
    GROUP BY subject
)
SELECT
    CASE
        WHEN is_longer AND is_shorter THEN 'both'
        WHEN is_longer THEN 'longer'
        WHEN is_shorter THEN 'shorter'
        WHEN only_in IS NOT NULL THEN only_in
        WHEN alike IS NOT NULL THEN 'about equal'
        WHEN estimated IS NOT NULL THEN 'none shown'
        ELSE median.verdict
    END AS change,
    coalesce(differing, alike, estimated) AS of,
    median.a AS a_median_ns, median.b AS b_median_ns, median.percent AS median_percent,
    median.verdict AS median_verdict, p95.a AS a_p95_ns, p95.b AS b_p95_ns,
    p95.percent AS p95_percent, p95.verdict AS p95_verdict, longest.a AS a_max_ns,
    longest.b AS b_max_ns, longest.percent AS max_percent, longest.verdict AS max_verdict,
    a_share, b_share, a_count, b_count, a_ambiguous, b_ambiguous, subject AS path
FROM subject
ORDER BY
    is_longer OR is_shorter OR only_in IS NOT NULL DESC,
    abs(median.b - median.a) DESC NULLS FIRST,
    subject
