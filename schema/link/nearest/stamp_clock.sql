-- description: How far the clock that stamps messages is from that of the traces, over time. In
--     each stretch of time, the difference that most messages allow is followed from the stretch
--     before. Where one difference explains a longer time, the clocks stood; between two such
--     times they stepped. Else they drift: the drift that shows makes the vote of the messages
--     sharper, and the vote the drift. In the end, messages are told apart that were published
--     within microseconds.
-- grain: one row per clock and stretch of time with messages; message_count is 0 where the
--     difference is not known
-- when: derive.unstamped_call
CREATE OR REPLACE MACRO derive.stamp_clock(only_run) AS TABLE
WITH pair AS MATERIALIZED (FROM derive.stamp_pair(only_run)),
-- The stamp minus the time of the publication nearest to it changes as the difference of the clocks
-- does, as long as the publication is at the same place of its period.
latest AS (
    SELECT
        clock_id,
        publisher_id AS place,
        stretch,
        median(greatest_ns) AS offset_ns,
        median(written_ns) AS at_ns
    FROM pair
    WHERE is_latest
    GROUP BY clock_id, publisher_id, stretch
),
drift AS MATERIALIZED (FROM derive.clock_drift('latest')),
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
    SELECT
        clock_id,
        2 * stretch AS stretch,
        least_ns, greatest_ns
    FROM pair
    UNION ALL
    SELECT
        p.clock_id,
        2 * p.stretch + 1,
        p.least_ns - round(p.beyond_middle_ns * d.drift_ppb / 1e9)::BIGINT,
        p.greatest_ns - round(p.beyond_middle_ns * d.drift_ppb / 1e9)::BIGINT
    FROM pair AS p
    JOIN drift AS d ON p.clock_id = d.clock_id AND p.stretch = d.stretch
    WHERE d.drift_ppb <> 0
),
agreed AS (
    SELECT
        clock_id,
        stretch // 2 AS stretch,
        least_ns, greatest_ns, difference_ns, vote_count, most_count
    FROM derive.agreed_difference('allowed')
    QUALIFY rank() OVER (PARTITION BY clock_id, stretch // 2 ORDER BY most_count DESC, stretch) = 1
),
origin AS (
    SELECT
        clock_id, stretch,
        avg(is_taken_here::INTEGER) >= 0.5 AS is_taken_here
    FROM pair
    GROUP BY clock_id, stretch
),
region AS MATERIALIZED (
    SELECT
        a.clock_id, a.stretch, a.least_ns, a.greatest_ns, a.difference_ns, a.vote_count,
        a.most_count, o.is_taken_here, x.stretch_ns
    FROM agreed AS a
    JOIN origin AS o ON a.clock_id = o.clock_id AND a.stretch = o.stretch
    JOIN extent AS x ON a.clock_id = x.clock_id
),
followed AS MATERIALIZED (FROM derive.followed_difference('region')),
course AS MATERIALIZED (
    SELECT
        f.clock_id,
        f.segment AS place,
        f.stretch,
        f.difference_ns AS offset_ns,
        x.start_ns + f.stretch * x.stretch_ns + x.stretch_ns // 2 AS at_ns,
        x.stretch_ns
    FROM followed AS f
    JOIN extent AS x ON f.clock_id = x.clock_id
    WHERE f.message_count > 0
),
close AS MATERIALIZED (FROM derive.close_pair('pair', 'course')),
-- Each vote makes the drift better known, so that the next vote can be of more stretches.
beside AS MATERIALIZED (
    FROM derive.sharp_difference('close', 'course', derive.clock_limit().sharp_stretches // 2)
),
sharp AS MATERIALIZED (
    FROM derive.sharp_difference('close', 'beside', derive.clock_limit().sharp_stretches)
),
chosen AS MATERIALIZED (
    SELECT c.clock_id, c.place, c.stretch, c.offset_ns, r.least_ns, r.greatest_ns, r.most_count
    FROM course AS c
    JOIN region AS r
        ON c.clock_id = r.clock_id AND c.stretch = r.stretch AND c.offset_ns = r.difference_ns
),
standing AS MATERIALIZED (FROM derive.standing_difference('close', 'chosen')),
-- Beside a small step, most of several stretches outvote what the messages of one say themselves.
agreeing AS (
    SELECT
        s.clock_id, s.stretch, s.drift_ppb,
        s.is_sharp AND s.is_own AS is_sharp,
        CASE WHEN s.is_own THEN s.offset_ns END AS offset_ns
    FROM (
        SELECT
            s.*,
            s.offset_ns BETWEEN c.least_ns - derive.clock_limit().slack_ns
                AND c.greatest_ns + derive.clock_limit().slack_ns AS is_own
        FROM sharp AS s
        JOIN chosen AS c ON s.clock_id = c.clock_id AND s.stretch = c.stretch
    ) AS s
),
-- Between two stretches in which the clocks stood alike, they stood so.
placed AS (
    SELECT
        f.clock_id, f.stretch, f.difference_ns, f.message_count, f.segment,
        last_value(t.span IGNORE NULLS) OVER on_clock AS before_span,
        first_value(t.span IGNORE NULLS) OVER behind AS after_span,
        last_value(t.difference_ns IGNORE NULLS) OVER on_clock AS standing_ns
    FROM followed AS f
    LEFT JOIN standing AS t ON f.clock_id = t.clock_id AND f.stretch = t.stretch
    WINDOW
        on_clock AS (PARTITION BY f.clock_id, f.segment ORDER BY f.stretch),
        behind AS (
            PARTITION BY f.clock_id, f.segment ORDER BY f.stretch
            ROWS BETWEEN CURRENT ROW AND UNBOUNDED FOLLOWING
        )
)
SELECT
    x.run_id, f.clock_id,
    x.start_ns + f.stretch * x.stretch_ns + x.stretch_ns // 2 AS at_ns,
    x.start_ns + f.stretch * x.stretch_ns AS start_ns,
    x.start_ns + (f.stretch + 1) * x.stretch_ns AS end_ns,
    CASE
        WHEN f.before_span = f.after_span THEN f.standing_ns
        ELSE coalesce(s.offset_ns, f.difference_ns)
    END AS difference_ns,
    CASE WHEN f.before_span = f.after_span THEN 0 ELSE coalesce(s.drift_ppb, 0) END::BIGINT
        AS drift_ppb,
    -- Clocks that stand do not drift as well: beside the time in which they stood, they were set.
    CASE
        WHEN f.before_span = f.after_span THEN greatest(f.message_count, 1)
        WHEN coalesce(f.before_span, f.after_span) IS NULL THEN f.message_count
        ELSE 0
    END AS message_count,
    dense_rank() OVER (
        PARTITION BY f.clock_id ORDER BY f.segment, coalesce(f.before_span, f.after_span)
    ) - 1 AS segment,
    -- Two stretches agree with some drift by chance. A stretch that is not sharp spoils those
    -- nearby.
    coalesce(f.before_span = f.after_span, false)
    OR min(s.is_sharp) OVER nearby
    AND count_if(f.message_count > 0) OVER nearby >= derive.clock_limit().sharp_stretches
        AS is_sharp
FROM placed AS f
JOIN extent AS x ON f.clock_id = x.clock_id
LEFT JOIN agreeing AS s ON f.clock_id = s.clock_id AND f.stretch = s.stretch
WINDOW nearby AS (
    PARTITION BY f.clock_id, f.segment
    ORDER BY f.stretch
    RANGE BETWEEN derive.clock_limit().sharp_stretches PRECEDING
        AND derive.clock_limit().sharp_stretches FOLLOWING
)
