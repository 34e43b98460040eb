-- description: Where two clocks stood in one relation, and in which. The clocks of one boot run at
--     one rate and only step (clock_gettime(2)), so this is looked for before any drift. As long
--     as the ranges of differences overlap from stretch to stretch, one difference may hold. It
--     does if it explains nearly as many messages as the stretches do with one each, and a drift
--     does not show: no stretch has a difference outside of the range that all of them allow.
-- grain: one row per clock and stretch in which the clocks stood
-- param: pairs VARCHAR  Name of rows of clock_id, stretch, least_ns, greatest_ns
-- param: chosen VARCHAR  Name of rows of clock_id, place, stretch, offset_ns, least_ns,
--     greatest_ns, most_count
CREATE OR REPLACE MACRO derive.standing_difference(pairs, chosen) AS TABLE
WITH span AS MATERIALIZED (
    SELECT
        clock_id, stretch, offset_ns, most_count,
        sum(CASE WHEN stays THEN 0 ELSE 1 END) OVER (
            PARTITION BY clock_id ORDER BY stretch ROWS UNBOUNDED PRECEDING
        )::BIGINT AS place
    FROM (
        SELECT
            clock_id, stretch, offset_ns, most_count,
            coalesce(
                least_ns <= lag(greatest_ns) OVER on_clock
                AND greatest_ns >= lag(least_ns) OVER on_clock
                AND place = lag(place) OVER on_clock,
                false
            ) AS stays
        FROM query_table(chosen)
        WINDOW on_clock AS (PARTITION BY clock_id ORDER BY stretch)
    )
),
allowed AS (
    SELECT
        p.clock_id,
        s.place AS stretch,
        p.least_ns, p.greatest_ns
    FROM query_table(pairs) AS p
    JOIN span AS s ON p.clock_id = s.clock_id AND p.stretch = s.stretch
),
agreed AS (
    SELECT
        clock_id,
        stretch AS place,
        arg_max(a, (vote_count, difference_ns)) AS best
    FROM derive.agreed_difference('allowed') AS a
    GROUP BY clock_id, stretch
),
stood AS (
    SELECT
        s.clock_id, s.place,
        a.best.difference_ns AS difference_ns
    FROM span AS s
    JOIN agreed AS a ON s.clock_id = a.clock_id AND s.place = a.place
    GROUP BY s.clock_id, s.place, a.best
    HAVING count(*) >= derive.clock_limit().sharp_stretches
        AND bool_and(s.offset_ns BETWEEN a.best.least_ns AND a.best.greatest_ns)
        AND a.best.vote_count >= derive.clock_limit().standing_share * sum(s.most_count)
)
SELECT
    s.clock_id, s.stretch,
    s.place AS span,
    t.difference_ns
FROM span AS s
JOIN stood AS t ON s.clock_id = t.clock_id AND s.place = t.place
