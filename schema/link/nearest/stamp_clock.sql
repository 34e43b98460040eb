-- name: derive.stamp_clock
-- kind: macro
-- description: How far the clock that stamps messages is from that of the traces, over time:
--     constant but for jumps and a slow drift. In each stretch of time, the difference that most
--     messages allow is followed from the stretch before. The drift that this shows makes the
--     vote of the messages sharper, and the vote the drift. In the end, messages are told apart
--     that were published within microseconds.
-- grain: one row per clock and stretch of time with messages; message_count is 0 where the
--     difference is not known
-- param: only_run BIGINT  Run to look at
-- when: derive.unstamped_process
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
allowed AS (
    SELECT
        p.clock_id, p.stretch,
        p.least_ns - round(p.beyond_middle_ns * coalesce(d.drift_ppb, 0) / 1e9)::BIGINT AS least_ns,
        p.greatest_ns - round(p.beyond_middle_ns * coalesce(d.drift_ppb, 0) / 1e9)::BIGINT
            AS greatest_ns
    FROM pair AS p
    LEFT JOIN drift AS d ON p.clock_id = d.clock_id AND p.stretch = d.stretch
),
origin AS (
    SELECT clock_id, stretch, avg(is_taken_here::INTEGER) >= 0.5 AS is_taken_here
    FROM pair
    GROUP BY clock_id, stretch
),
region AS MATERIALIZED (
    SELECT
        a.clock_id, a.stretch, a.least_ns, a.greatest_ns, a.difference_ns, a.vote_count,
        a.most_count, o.is_taken_here, x.stretch_ns
    FROM derive.agreed_difference('allowed') AS a
    JOIN origin AS o ON a.clock_id = o.clock_id AND a.stretch = o.stretch
    JOIN extent AS x ON a.clock_id = x.clock_id
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
)
SELECT
    x.run_id,
    f.clock_id,
    x.start_ns + f.stretch * x.stretch_ns + x.stretch_ns // 2 AS at_ns,
    x.start_ns + f.stretch * x.stretch_ns AS start_ns,
    x.start_ns + (f.stretch + 1) * x.stretch_ns AS end_ns,
    coalesce(s.offset_ns, f.difference_ns) AS difference_ns,
    coalesce(s.drift_ppb, 0)::BIGINT AS drift_ppb,
    f.message_count,
    f.segment,
    -- A drift needs two stretches to show. A stretch that is not sharp spoils those nearby.
    coalesce(
        min(s.is_sharp) OVER nearby AND count_if(f.message_count > 0) OVER nearby > 1, false
    ) AS is_sharp
FROM followed AS f
JOIN extent AS x ON f.clock_id = x.clock_id
LEFT JOIN sharp AS s ON f.clock_id = s.clock_id AND f.stretch = s.stretch
WINDOW nearby AS (
    PARTITION BY f.clock_id, f.segment
    ORDER BY f.stretch
    RANGE BETWEEN derive.clock_limit().sharp_stretches PRECEDING
        AND derive.clock_limit().sharp_stretches FOLLOWING
)
