-- description: How far the clock that stamps messages is from that of the traces. It is constant,
--     or drifts evenly, until it is set: a line for each time between two steps, from the messages
--     of that time alone. A line is certain in stretches of time that agree with it, between others
--     that do: in a stretch beside a step, the clock may have been set already. What most stretches
--     say is found first; then those that do not agree have lines of their own.
-- grain: one row per clock and time in which one line is certain
-- when: derive.unstamped_call
CREATE OR REPLACE MACRO derive.stamp_clock(only_run) AS TABLE
WITH pair AS MATERIALIZED (FROM derive.stamp_pair(only_run)),
stretch AS MATERIALIZED (
    SELECT
        clock_id, stretch,
        median(source_timestamp_ns)::BIGINT AS at_ns,
        min(source_timestamp_ns) AS start_ns,
        max(source_timestamp_ns) AS end_ns,
        count(DISTINCT source_timestamp_ns) AS message_count,
        avg(is_taken_here::INTEGER) >= 0.5 AS is_taken_here
    FROM pair
    GROUP BY clock_id, stretch
),
region AS MATERIALIZED (
    SELECT r.*, s.at_ns, s.start_ns, s.end_ns, s.is_taken_here, s.message_count
    FROM (
        SELECT
            *,
            true AS is_rival
        FROM derive.agreed_difference('pair', derive.clock_limit().rival_share)
        UNION ALL
        SELECT
            *,
            false
        FROM derive.agreed_difference('pair', derive.clock_limit().explained_share)
    ) AS r
    JOIN stretch AS s ON r.clock_id = s.clock_id AND r.stretch = s.stretch
    WHERE r.most_count >= derive.clock_limit().quorum
),
-- Two stretches in which publications were lost agree with some difference by chance. So they do at
-- the begin and the end, where most messages are of other publishers.
followed AS (
    SELECT
        *,
        segment = 0
        OR count(*) OVER in_segment >= derive.clock_limit().sharp_stretches AS is_lasting,
        min(stretch) OVER in_segment = min(stretch) OVER on_clock
        OR max(stretch) OVER in_segment = max(stretch) OVER on_clock AS is_at_edge,
        segment = 0 OR avg(is_alone::INTEGER) OVER in_segment >= 0.5 AS is_alone_mostly
    FROM derive.followed_difference('region')
    WINDOW
        on_clock AS (PARTITION BY clock_id),
        in_segment AS (PARTITION BY clock_id, segment)
),
course AS MATERIALIZED (
    SELECT
        f.clock_id, f.segment, f.stretch, f.difference_ns, r.at_ns, r.start_ns, r.end_ns,
        r.least_ns, r.greatest_ns, r.most_count,
        r.most_count / r.message_count AS share,
        CASE WHEN r.is_taken_here THEN f.is_soon ELSE f.is_alone_mostly END AS is_told
    FROM followed AS f
    JOIN region AS r
        ON f.clock_id = r.clock_id
        AND f.stretch = r.stretch
        AND f.difference_ns = r.difference_ns
        AND r.is_rival
    WHERE f.is_lasting OR (f.is_at_edge AND share >= derive.clock_limit().explained_share)
),
-- What is not told has no vote, nor has what is beside it: the clock may have been set there.
known AS MATERIALIZED (
    FROM course
    QUALIFY bool_and(is_told) OVER (
        PARTITION BY clock_id ORDER BY stretch ROWS BETWEEN 1 PRECEDING AND 1 FOLLOWING
    )
),
judged AS (
    SELECT
        c.*, l.agrees,
        count_if(l.agrees) OVER (
            PARTITION BY c.clock_id ORDER BY c.stretch ROWS UNBOUNDED PRECEDING
        ) AS place
    FROM known AS c
    JOIN derive.stamp_line('pair', 'known') AS l
        ON c.clock_id = l.clock_id AND c.stretch = l.stretch
),
divided AS MATERIALIZED (
    SELECT
        * REPLACE (
            dense_rank() OVER (
                PARTITION BY clock_id ORDER BY segment, CASE WHEN NOT agrees THEN place END
            ) AS segment
        )
    FROM judged
),
line AS MATERIALIZED (FROM derive.stamp_line('pair', 'divided')),
-- A clock that was never set.
only_line AS (
    SELECT
        clock_id,
        any_value(segment) AS segment,
        max(CASE WHEN agrees THEN stretch END) AS last_stretch,
        any_value(middle_ns) AS middle_ns,
        any_value(difference_ns) AS difference_ns,
        any_value(drift_ppb) AS drift_ppb,
        any_value(slack_ns) AS slack_ns
    FROM line
    GROUP BY clock_id
    HAVING count(DISTINCT segment) = 1
),
-- What is not told does not say that such a clock was set, if the line may hold there and does so
-- later: a clock that was set stays so.
-- Where a clock was set back, messages of two times have the same stamps: no difference explains
-- as many as usual.
told AS (
    SELECT
        c.clock_id, c.stretch, c.start_ns, c.end_ns,
        coalesce(l.segment, o.segment) AS segment,
        coalesce(l.middle_ns, o.middle_ns) AS middle_ns,
        coalesce(l.difference_ns, o.difference_ns) AS difference_ns,
        coalesce(l.drift_ppb, o.drift_ppb) AS drift_ppb,
        coalesce(l.slack_ns, o.slack_ns) AS slack_ns,
        coalesce(
            l.agrees,
            c.stretch < o.last_stretch
            AND o.difference_ns + ((c.at_ns - o.middle_ns) * o.drift_ppb / 1e9)::BIGINT
                BETWEEN c.least_ns AND c.greatest_ns,
            false
        )
        AND (
            o.clock_id IS NOT NULL
            OR c.share >= derive.clock_limit().unmixed_share * max(c.share) OVER on_clock
        ) AS agrees
    FROM course AS c
    LEFT JOIN line AS l ON c.clock_id = l.clock_id AND c.stretch = l.stretch
    LEFT JOIN only_line AS o ON c.clock_id = o.clock_id
    WINDOW on_clock AS (PARTITION BY c.clock_id)
),
certain AS (
    SELECT
        *,
        lag(stretch) OVER on_clock IS NULL AS is_first,
        lead(stretch) OVER on_clock IS NULL AS is_last,
        bool_and(agrees) OVER beside AND min(segment) OVER beside = max(segment) OVER beside
            AS is_certain
    FROM told
    WINDOW
        on_clock AS (PARTITION BY clock_id ORDER BY stretch),
        beside AS (on_clock ROWS BETWEEN 1 PRECEDING AND 1 FOLLOWING)
),
run AS (
    SELECT
        *,
        count_if(NOT is_certain) OVER (
            PARTITION BY clock_id ORDER BY stretch ROWS UNBOUNDED PRECEDING
        ) AS place
    FROM certain
)
SELECT
    any_value(only_run)::BIGINT AS run_id,
    clock_id,
    CASE WHEN NOT bool_or(is_first) THEN min(start_ns) END AS start_ns,
    CASE WHEN NOT bool_or(is_last) THEN max(end_ns) END AS end_ns,
    middle_ns AS at_ns,
    difference_ns, drift_ppb, slack_ns
FROM run
WHERE is_certain
GROUP BY clock_id, place, middle_ns, difference_ns, drift_ppb, slack_ns
