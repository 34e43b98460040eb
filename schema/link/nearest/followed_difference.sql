-- description: Which of the differences that messages agree with is the right one, from stretch
--     to stretch: the nearest to that of the stretch before. The clocks of one machine begin
--     together. Where no drift leads from one to the next, not even from the begin of one to the
--     end of the other, the clock was set. A message is taken,
--     and stamped, soon after it was published: if messages that were taken on this clock could as
--     well be those of much later publications, the clock may have been set by a period.
-- grain: one row per row of the course of a clock: stretch of time in which messages agree
-- param: regions VARCHAR  Rows as of derive.agreed_difference, start_ns, end_ns
CREATE OR REPLACE MACRO derive.followed_difference(regions) AS TABLE
WITH RECURSIVE region AS MATERIALIZED (
    SELECT
        *,
        difference_ns <= min(difference_ns) OVER in_stretch + derive.clock_limit().burst_ns
            AS is_soon,
        max(difference_ns) OVER in_stretch - min(difference_ns) OVER in_stretch
        <= derive.clock_limit().burst_ns AS is_alone,
        dense_rank() OVER (PARTITION BY clock_id ORDER BY stretch) AS number
    FROM query_table(regions)
    WINDOW in_stretch AS (PARTITION BY clock_id, stretch)
),
followed AS (
    SELECT
        clock_id,
        0 AS number,
        0 AS segment,
        NULL::BIGINT AS stretch,
        {
            'difference_ns': 0::BIGINT,
            'least_ns': 0::BIGINT,
            'greatest_ns': 0::BIGINT,
            'start_ns': min(start_ns),
            'is_soon': true,
            'is_alone': true,
            'is_set': false
        } AS near
    FROM region
    GROUP BY clock_id
    UNION ALL
    SELECT
        clock_id, number,
        segment + near.is_set::INTEGER,
        stretch, near
    FROM (
        SELECT
            f.clock_id, r.number, f.segment, r.stretch,
            arg_min(
                {
                    'difference_ns': r.difference_ns,
                    'least_ns': r.least_ns,
                    'greatest_ns': r.greatest_ns,
                    'start_ns': r.start_ns,
                    'is_soon': r.is_soon,
                    'is_alone': r.is_alone,
                    'is_set':
                        greatest(r.least_ns - f.near.greatest_ns, f.near.least_ns - r.greatest_ns)
                        > (r.end_ns - f.near.start_ns)::DOUBLE
                        * derive.clock_limit().drift_ppb / 1e9
                },
                (abs(r.difference_ns - f.near.difference_ns), r.difference_ns)
            ) AS near
        FROM followed AS f
        JOIN region AS r ON f.clock_id = r.clock_id AND f.number + 1 = r.number
        GROUP BY f.clock_id, r.number, f.segment, r.stretch
    )
)
SELECT
    clock_id, segment, stretch,
    near.difference_ns AS difference_ns,
    near.is_soon AS is_soon,
    near.is_alone AS is_alone
FROM followed
WHERE number > 0
