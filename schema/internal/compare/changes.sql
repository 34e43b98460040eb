-- title: What changed
-- description: A comparison (`compared`: rows of `main.comparison`) with a row for each subject,
--     those that differ first, then the greatest change of a median.
-- grain: one row per path, callback or topic
-- reads: compared
-- column: change VARCHAR            'longer', 'shorter', 'both' (of different statistics), 'only in
--     A', 'only in B', 'about equal' (less than matters), 'none shown' (the intervals contain 0),
--     or why it is not known: 'too few values', 'too few independent values', 'too few resamples'
-- column: of VARCHAR                Statistics that changed like this
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
-- column: a_count, b_count
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
        string_agg(statistic, ', ') FILTER (WHERE verdict IN ('B is longer', 'B is shorter'))
            AS differing,
        string_agg(statistic, ', ') FILTER (WHERE verdict = 'about equal') AS alike,
        string_agg(statistic, ', ') FILTER (WHERE verdict = 'no difference shown') AS estimated
    FROM compared
    GROUP BY subject
)
SELECT
    CASE
        WHEN s.is_longer AND s.is_shorter THEN 'both'
        WHEN s.is_longer THEN 'longer'
        WHEN s.is_shorter THEN 'shorter'
        WHEN s.only_in IS NOT NULL THEN s.only_in
        WHEN s.alike IS NOT NULL THEN 'about equal'
        WHEN s.estimated IS NOT NULL THEN 'none shown'
        ELSE m.verdict
    END AS change,
    coalesce(s.differing, s.alike, s.estimated) AS of,
    m.a_ns AS a_median_ns,
    m.b_ns AS b_median_ns,
    m.change_percent AS median_percent,
    m.verdict AS median_verdict,
    p.a_ns AS a_p95_ns,
    p.b_ns AS b_p95_ns,
    p.change_percent AS p95_percent,
    p.verdict AS p95_verdict,
    l.a_ns AS a_max_ns,
    l.b_ns AS b_max_ns,
    l.change_percent AS max_percent,
    l.verdict AS max_verdict,
    m.a_share, m.b_share, m.a_count, m.b_count, m.a_ambiguous, m.b_ambiguous,
    s.subject AS path
FROM subject AS s
LEFT JOIN compared AS m ON s.subject = m.subject AND m.statistic = 'median'
LEFT JOIN compared AS p ON s.subject = p.subject AND p.statistic = 'p95'
LEFT JOIN compared AS l ON s.subject = l.subject AND l.statistic = 'max'
ORDER BY
    s.is_longer OR s.is_shorter OR s.only_in IS NOT NULL DESC,
    abs(m.b_ns - m.a_ns) DESC NULLS FIRST,
    s.subject
