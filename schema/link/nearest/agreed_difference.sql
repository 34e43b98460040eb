-- description: The differences of two clocks that may be the right one: those that a share of the
--     messages allow that allow the best one. They form ranges without a gap, a row each. In a
--     range, the middle of what most messages allow is furthest from giving a message to another
--     publication. If that part is wide, the right difference is near its upper end, because the
--     shortest delays are short.
-- grain: one row per clock, stretch of time and stretch of differences
-- param: intervals VARCHAR  Name of rows of clock_id, stretch, least_ns, greatest_ns
-- param: share DOUBLE  Of the messages that allow the best one
CREATE OR REPLACE MACRO derive.agreed_difference(intervals, share) AS TABLE
WITH edge AS (
    SELECT
        clock_id, stretch,
        least_ns AS from_ns,
        1 AS step
    FROM query_table(intervals)
    UNION ALL
    SELECT clock_id, stretch, greatest_ns, -1
    FROM query_table(intervals)
),
level AS MATERIALIZED (
    SELECT
        clock_id, stretch, from_ns,
        lead(from_ns) OVER by_difference AS until_ns,
        sum(step) OVER (by_difference ROWS UNBOUNDED PRECEDING) AS vote_count
    FROM edge
    WINDOW by_difference AS (PARTITION BY clock_id, stretch ORDER BY from_ns, step)
),
most AS (
    SELECT
        clock_id, stretch,
        max(vote_count) AS most_count
    FROM level
    GROUP BY clock_id, stretch
),
high AS (
    SELECT l.clock_id, l.stretch, l.from_ns, l.until_ns, l.vote_count, m.most_count
    FROM level AS l
    JOIN most AS m
        ON l.clock_id = m.clock_id
        AND l.stretch = m.stretch
        AND l.vote_count >= share * m.most_count
    WHERE l.until_ns > l.from_ns
),
separated AS (
    SELECT
        clock_id, stretch, from_ns, until_ns, vote_count, most_count,
        sum(CASE WHEN follows THEN 0 ELSE 1 END) OVER (
            PARTITION BY clock_id, stretch ORDER BY from_ns ROWS UNBOUNDED PRECEDING
        ) AS region
    FROM (
        SELECT
            clock_id, stretch, from_ns, until_ns, vote_count, most_count,
            from_ns = lag(until_ns) OVER (PARTITION BY clock_id, stretch ORDER BY from_ns)
                AS follows
        FROM high
    )
),
best AS (
    SELECT
        clock_id, stretch, region, from_ns, until_ns, vote_count, most_count,
        vote_count = max(vote_count) OVER (PARTITION BY clock_id, stretch, region) AS is_best
    FROM separated
)
SELECT
    clock_id, stretch,
    min(from_ns) AS least_ns,
    max(until_ns) AS greatest_ns,
    greatest(
        (min(CASE WHEN is_best THEN from_ns END) + max(CASE WHEN is_best THEN until_ns END)) // 2,
        max(CASE WHEN is_best THEN until_ns END) - derive.clock_limit().slack_ns
    ) AS difference_ns,
    max(vote_count)::BIGINT AS vote_count,
    any_value(most_count)::BIGINT AS most_count
FROM best
GROUP BY clock_id, stretch, region
