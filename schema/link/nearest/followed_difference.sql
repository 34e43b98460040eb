-- description: Which of the differences that messages agree with is the right one, from stretch
--     to stretch: the nearest to that of the stretch before. The clocks of one machine begin
--     together. Where no drift leads from one to the next, not even from the begin of one to the
--     end of the other, the clock was set, to the least difference if messages were taken on it: a
--     message is taken, and stamped, soon after it was published. If these could as well be those
--     of much later publications, it may have been set by a period. Where publications were lost,
--     messages agree with greater differences. If half of the messages agree with the difference
--     of before, some stretches say nothing; else, where all do again, the line of the last time
--     that lasted is right.
-- grain: one row per row of the course of a clock: stretch of time in which messages agree
-- param: regions VARCHAR  Rows as of derive.agreed_difference, start_ns, end_ns, is_taken_here,
--     is_rival: nine tenths of the messages agree, else half of them
CREATE OR REPLACE MACRO derive.followed_difference(regions) AS TABLE
WITH RECURSIVE region AS MATERIALIZED (
    SELECT
        *,
        NOT is_taken_here
        OR difference_ns
        <= min(difference_ns) FILTER (is_rival) OVER in_stretch + derive.clock_limit().burst_ns
            AS is_soon,
        max(difference_ns) FILTER (is_rival) OVER in_stretch
        - min(difference_ns) FILTER (is_rival) OVER in_stretch
        <= derive.clock_limit().burst_ns AS is_alone,
        dense_rank() OVER (PARTITION BY clock_id ORDER BY stretch) AS number
    FROM query_table(regions)
    WINDOW in_stretch AS (PARTITION BY clock_id, stretch)
    QUALIFY is_rival OR is_soon
),
followed AS (
    SELECT
        clock_id,
        0 AS number,
        NULL::BIGINT AS stretch,
        {
            'segment': 0::BIGINT,
            'number': 0::BIGINT,
            'stretch_count': derive.clock_limit().sharp_stretches::BIGINT,
            'difference_ns': 0::BIGINT,
            'least_ns': 0::BIGINT,
            'greatest_ns': 0::BIGINT,
            'start_ns': min(start_ns),
            'is_soon': true,
            'is_alone': true
        } AS near,
        if(false, near, NULL) AS former
    FROM region
    GROUP BY clock_id
    UNION ALL
    SELECT
        clock_id, number, stretch,
        arg_min(
            CASE
                WHEN is_rival OR NOT is_near
                    THEN {
                        'segment':
                            CASE
                                WHEN is_return THEN former.segment
                                WHEN is_near THEN near.segment
                                ELSE number
                            END,
                        'number': number,
                        'stretch_count':
                            1 + CASE
                                WHEN is_return THEN former.stretch_count
                                WHEN is_near THEN near.stretch_count
                                ELSE 0
                            END,
                        'difference_ns': difference_ns,
                        'least_ns': least_ns,
                        'greatest_ns': greatest_ns,
                        'start_ns': start_ns,
                        'is_soon': is_soon,
                        'is_alone': is_alone
                    }
                ELSE near
            END,
            (
                NOT is_near OR NOT is_good,
                NOT is_return,
                NOT is_near,
                NOT is_rival,
                NOT is_soon,
                abs(difference_ns - near.difference_ns),
                difference_ns
            )
        ),
        CASE
            WHEN any_value(near.stretch_count) >= derive.clock_limit().sharp_stretches
                THEN any_value(near)
            ELSE any_value(former)
        END
    FROM (
        SELECT
            f.near, f.former, r.*,
            greatest(r.least_ns - f.near.greatest_ns, f.near.least_ns - r.greatest_ns)
            <= (r.end_ns - f.near.start_ns)::DOUBLE * derive.clock_limit().drift_ppb / 1e9
            AND (r.is_rival OR r.number - f.near.number <= derive.clock_limit().sharp_stretches)
                AS is_near,
            r.is_rival AND CASE WHEN r.is_taken_here THEN r.is_soon ELSE r.is_alone END AS is_good,
            NOT (is_near AND is_good)
            AND r.is_rival
            AND r.is_soon
            AND coalesce(
                greatest(r.least_ns - f.former.greatest_ns, f.former.least_ns - r.greatest_ns)
                <= (r.end_ns - f.former.start_ns)::DOUBLE * derive.clock_limit().drift_ppb / 1e9,
                false
            ) AS is_return
        FROM followed AS f
        JOIN region AS r ON f.clock_id = r.clock_id AND f.number + 1 = r.number
    )
    GROUP BY clock_id, number, stretch
)
SELECT
    clock_id,
    near.segment AS segment,
    stretch,
    near.difference_ns AS difference_ns,
    near.is_soon AS is_soon,
    near.is_alone AS is_alone
FROM followed
WHERE near.number = number AND number > 0
