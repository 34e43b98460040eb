-- name: derive.stamp_clock
-- kind: macro
-- description: How far the clock that stamps messages is from that of the traces, over time. In
--     each stretch of time, the difference that most messages allow is followed from the stretch
--     before. Where one difference explains a longer time, the clocks stood; between two such
--     times they stepped. Else they drift: the drift that shows makes the vote of the messages
--     sharper, and the vote the drift. In the end, messages are told apart that were published
--     within microseconds.
-- grain: one row per clock and stretch of time with messages; message_count is 0 where the
--     difference is not known
-- param: only_run BIGINT  Run to look at
-- when: derive.unstamped_call
CREATE OR REPLACE MACRO derive.stamp_clock(only_run) AS TABLE
WITH pair AS MATERIALIZED (
    FROM derive.stamp_pair(only_run)
),
-- The stamp minus the time of the publication nearest to it changes as the difference of the clocks
-- does, as long as the publication is at the same place of its period.
latest AS (
    SELECT
        clock_id, publisher_id AS place, stretch,
        median(greatest_ns) AS offset_ns,
        median(written_ns) AS at_ns
    FROM pair
    WHERE is_latest
    GROUP BY clock_id, publisher_id, stretch
),
drift AS MATERIALIZED (
    FROM derive.clock_drift('latest')
),
extent AS (
    SELECT
        clock_id,
        any_value(run_id) AS run_id,
        any_value(start_ns) AS start_ns,
        any_value(stretch_ns) AS stretch_ns
    FROM pair
    GROUP BY clock_id
),
-- No drift first, since most clocks of stamps have none and the slopes above may be of chance.
allowed AS (
    SELECT clock_id, 2 * stretch AS stretch, least_ns, greatest_ns
    FROM pair
    UNION ALL
    SELECT
        p.clock_id, 2 * p.stretch + 1,
        p.least_ns - round(p.beyond_middle_ns * d.drift_ppb / 1e9)::BIGINT,
        p.greatest_ns - round(p.beyond_middle_ns * d.drift_ppb / 1e9)::BIGINT
    FROM pair AS p
    JOIN drift AS d ON p.clock_id = d.clock_id AND p.stretch = d.stretch
    WHERE d.drift_ppb <> 0
),
agreed AS (
    SELECT
        clock_id, stretch // 2 AS stretch, least_ns, greatest_ns, difference_ns, vote_count,
        most_count
    FROM derive.agreed_difference('allowed')
    QUALIFY rank() OVER (
        PARTITION BY clock_id, stretch // 2 ORDER BY most_count DESC, stretch
    ) = 1
),
origin AS (
    SELECT clock_id, stretch, avg(is_taken_here::INTEGER) >= 0.5 AS is_taken_here
    FROM pair
    GROUP BY clock_id, stretch
),
-- By how much a clock may have been set back.
set_back AS (
    SELECT
        z.clock_id, (z.taken_ns - x.start_ns) // x.stretch_ns AS stretch,
        list(z.step_ns) AS steps_ns
    FROM derive.clock_set_back(only_run) AS z
    JOIN extent AS x ON z.clock_id = x.clock_id
    GROUP BY ALL
),
region AS MATERIALIZED (
    SELECT
        a.clock_id, a.stretch, a.least_ns, a.greatest_ns, a.difference_ns, a.vote_count,
        a.most_count, o.is_taken_here, x.stretch_ns, z.steps_ns
    FROM agreed AS a
    JOIN origin AS o ON a.clock_id = o.clock_id AND a.stretch = o.stretch
    JOIN extent AS x ON a.clock_id = x.clock_id
    LEFT JOIN set_back AS z ON a.clock_id = z.clock_id AND a.stretch = z.stretch
),
followed AS MATERIALIZED (
    FROM derive.followed_difference('region')
),
course AS MATERIALIZED (
    SELECT
        f.clock_id, f.segment AS place, f.stretch, f.difference_ns AS offset_ns,
        x.start_ns + f.stretch * x.stretch_ns + x.stretch_ns // 2 AS at_ns, x.stretch_ns
    FROM followed AS f
    JOIN extent AS x ON f.clock_id = x.clock_id
    WHERE f.message_count > 0
),
close AS MATERIALIZED (
    FROM derive.close_pair('pair', 'course')
),
-- Each vote makes the drift better known, so that the next vote can be of more stretches.
beside AS MATERIALIZED (
    FROM derive.sharp_difference('close', 'course', derive.clock_limit().sharp_stretches // 2)
),
sharp AS MATERIALIZED (
    FROM derive.sharp_difference('close', 'beside', derive.clock_limit().sharp_stretches)
),
chosen AS MATERIALIZED (
    SELECT
        c.clock_id, c.place, c.stretch, c.offset_ns, r.least_ns, r.greatest_ns, r.most_count
    FROM course AS c
    JOIN region AS r
        ON c.clock_id = r.clock_id AND c.stretch = r.stretch AND c.offset_ns = r.difference_ns
),
standing AS MATERIALIZED (
    FROM derive.standing_difference('close', 'chosen')
),
-- Between two stretches in which the clocks stood alike, they stood so. If they stepped, one
-- stretch may tell nothing, since half of it lies on either side.
placed AS (
    SELECT
        clock_id, stretch, difference_ns, message_count, segment,
        CASE WHEN before_span = after_span OR is_alone THEN later_ns END AS standing_ns,
        CASE WHEN before_span = after_span OR is_alone THEN after_span END AS span
    FROM (
        SELECT
            f.clock_id, f.stretch, f.difference_ns, f.message_count, f.segment,
            lag(t.span) OVER on_clock < lead(t.span) OVER on_clock
            AND lag(f.segment) OVER on_clock = lead(f.segment) OVER on_clock AS is_alone,
            last_value(t.span IGNORE NULLS) OVER on_clock AS before_span,
            first_value(t.span IGNORE NULLS) OVER behind AS after_span,
            first_value(t.difference_ns IGNORE NULLS) OVER behind AS later_ns
        FROM followed AS f
        LEFT JOIN standing AS t ON f.clock_id = t.clock_id AND f.stretch = t.stretch
        WINDOW
            on_clock AS (PARTITION BY f.clock_id ORDER BY f.stretch),
            behind AS (
                PARTITION BY f.clock_id ORDER BY f.stretch
                ROWS BETWEEN CURRENT ROW AND UNBOUNDED FOLLOWING
            )
    )
),
stepped AS (
    SELECT
        clock_id, stretch, difference_ns, standing_ns, is_step,
        CASE WHEN standing_ns IS NULL THEN message_count ELSE greatest(message_count, 1) END
            AS message_count,
        segment + sum(CASE WHEN is_step THEN 1 ELSE 0 END) OVER (
            PARTITION BY clock_id ORDER BY stretch ROWS UNBOUNDED PRECEDING
        )::BIGINT AS segment
    FROM (
        SELECT
            *,
            span > lag(span) OVER on_clock AND segment = lag(segment) OVER on_clock AS is_step
        FROM placed
        WINDOW on_clock AS (PARTITION BY clock_id ORDER BY stretch)
    )
),
-- Messages that one difference alone explains show until when a clock stood before a step, and
-- since when behind it.
step AS MATERIALIZED (
    SELECT
        f.clock_id, f.stretch, f.standing_ns, f.message_count, f.segment, x.run_id,
        lag(f.standing_ns) OVER (PARTITION BY f.clock_id ORDER BY f.stretch) AS before_ns,
        x.start_ns + (f.stretch - 1) * x.stretch_ns AS start_ns,
        x.start_ns + (f.stretch + 1) * x.stretch_ns AS end_ns
    FROM stepped AS f
    JOIN extent AS x ON f.clock_id = x.clock_id
    QUALIFY f.is_step
),
turn AS MATERIALIZED (
    SELECT
        clock_id, stretch,
        -- What was written then has its stamp.
        max(CASE WHEN is_before AND NOT is_behind THEN stamp_ns - before_ns END)
        - derive.clock_limit().write_ns AS until_ns,
        min(CASE WHEN is_behind AND NOT is_before THEN stamp_ns - standing_ns END) AS since_ns
    FROM (
        SELECT
            t.clock_id, t.stretch, t.before_ns, t.standing_ns,
            p.written_ns + p.greatest_ns AS stamp_ns,
            bool_or(t.before_ns BETWEEN p.least_ns AND p.greatest_ns) AS is_before,
            bool_or(t.standing_ns BETWEEN p.least_ns AND p.greatest_ns) AS is_behind
        FROM step AS t
        JOIN close AS p
            ON t.clock_id = p.clock_id AND p.stretch BETWEEN t.stretch - 1 AND t.stretch
        GROUP BY t.clock_id, t.stretch, t.before_ns, t.standing_ns, stamp_ns
    )
    GROUP BY clock_id, stretch
    HAVING until_ns < since_ns
),
-- Before that, after that, and what may be on either side.
side AS (
    SELECT
        clock_id, run_id, stretch, message_count, segment, before_ns, standing_ns,
        unnest([
            {first: start_ns, last: until_ns, is_before: true},
            {first: until_ns, last: middle_ns, is_before: true},
            {first: middle_ns, last: since_ns, is_before: false},
            {first: since_ns, last: end_ns, is_before: false}
        ], recursive := true)
    FROM (
        SELECT
            s.*, greatest(t.until_ns, s.start_ns) AS until_ns, t.since_ns,
            (greatest(t.until_ns, s.start_ns) + t.since_ns) // 2 AS middle_ns
        FROM step AS s
        JOIN turn AS t ON s.clock_id = t.clock_id AND s.stretch = t.stretch
    )
)
SELECT
    run_id, clock_id, first + (last - first) // 2 AS at_ns, first AS start_ns, last AS end_ns,
    CASE WHEN is_before THEN before_ns ELSE standing_ns END AS difference_ns,
    0::BIGINT AS drift_ppb,
    message_count,
    CASE WHEN is_before THEN segment - 1 ELSE segment END AS segment,
    true AS is_sharp
FROM side
WHERE first < last
UNION ALL
SELECT
    x.run_id,
    f.clock_id,
    x.start_ns + f.stretch * x.stretch_ns + x.stretch_ns // 2 AS at_ns,
    x.start_ns + f.stretch * x.stretch_ns AS start_ns,
    x.start_ns + (f.stretch + 1) * x.stretch_ns AS end_ns,
    coalesce(f.standing_ns, s.offset_ns, f.difference_ns) AS difference_ns,
    CASE WHEN f.standing_ns IS NULL THEN coalesce(s.drift_ppb, 0) ELSE 0 END::BIGINT AS drift_ppb,
    f.message_count,
    f.segment,
    -- Two stretches agree with some drift by chance. A stretch that is not sharp spoils those
    -- nearby.
    f.standing_ns IS NOT NULL
    OR min(s.is_sharp) OVER nearby
    AND count_if(f.message_count > 0) OVER nearby >= derive.clock_limit().sharp_stretches
        AS is_sharp
FROM stepped AS f
JOIN extent AS x ON f.clock_id = x.clock_id
LEFT JOIN sharp AS s ON f.clock_id = s.clock_id AND f.stretch = s.stretch
ANTI JOIN turn AS t
    ON f.clock_id = t.clock_id AND f.stretch BETWEEN t.stretch - 1 AND t.stretch
WINDOW nearby AS (
    PARTITION BY f.clock_id, f.segment
    ORDER BY f.stretch
    RANGE BETWEEN derive.clock_limit().sharp_stretches PRECEDING
        AND derive.clock_limit().sharp_stretches FOLLOWING
)
